#!/usr/bin/env python3
"""Draws the folders and what they include: docs/figures/architecture.svg.

    docs/figures/architecture.py [--check]

An arrow goes from a folder to one that it includes, unless the way leads through another folder already. Every arrow
must point down: the script fails for one that does not, and with --check also if the drawing is not up to date.
"""
import collections
import pathlib
import re
import sys

root = pathlib.Path(__file__).resolve().parents[2]
target = root / "docs/figures/architecture.svg"
# Row by row from the top; the number is the column.
ROWS = [{"python": 2}, {"cli": 1}, {"report": 1}, {"tables": 0, "study": 2, "check_proof": 3}, {"flight": 1}, {"vehicles/tiltrotor": 0, "vehicles/xv15": 2},
        {"simulate": 1, "tune": 3}, {"sweep": 2.5, "prove": 0}, {"follow": 2, "qualities": 3}, {"vehicles": 0, "trim": 1, "linearize": 2, "optimize": 3},
        {"model": 1, "design": 2.25}, {"dense": 1.5, "runtime": 3}]
VERBS = {"trim", "linearize", "qualities", "follow", "sweep", "simulate", "tune", "optimize"}
row_of = {folder: k for k, row in enumerate(ROWS) for folder in row}

includes = collections.defaultdict(set)
for folder in row_of:
    for source in [*(root / folder).glob("*.?pp"), *(root / folder).glob("src/*.?pp")]:
        for path in re.findall(r'^#include "([^"]+)/[^/"]+"', source.read_text(), re.M):
            if path in row_of and path != folder:
                includes[folder].add(path)

upwards = [f"{a} includes {b}" for a in includes for b in includes[a] if row_of[b] <= row_of[a]]


def reached(folder, without):
    """All that a folder includes, directly or not, but for one direct step."""
    seen, to_see = set(), [f for f in includes[folder] if f != without]
    while to_see:
        here = to_see.pop()
        if here not in seen:
            seen.add(here)
            to_see += includes[here]
    return seen


WIDTH, HEIGHT, GAP, BETWEEN = 165, 30, 40, 34
page = 4 * WIDTH + 5 * GAP
place = {}
for k, row in enumerate(ROWS):
    for folder, column in row.items():
        place[folder] = (GAP + column * (WIDTH + GAP), GAP / 2 + k * (HEIGHT + BETWEEN))

shapes = []
for a in sorted(includes):
    for b in sorted(includes[a]):
        if b in reached(a, b):
            continue
        (xa, ya), (xb, yb) = place[a], place[b]
        x1, y1, x2, y2 = xa + WIDTH / 2, ya + HEIGHT, xb + WIDTH / 2, yb
        bend = (y2 - y1) / 2
        shapes.append(f'<path d="M{x1:g} {y1:g}C{x1:g} {y1 + bend:g} {x2:g} {y2 - bend:g} {x2:g} {y2 - 5:g}"/>')
for folder, (x, y) in place.items():
    kind = "seam" if folder == "model" else "verb" if folder in VERBS else "box"
    shapes.append(f'<rect class="{kind}" x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="4"/>'
                  f'<text x="{x + WIDTH / 2:g}" y="{y + 20:g}">{folder}/</text>')

height = GAP + len(ROWS) * (HEIGHT + BETWEEN) - BETWEEN
drawing = f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {page} {height}" role="img">
<title>The folders of tiltrim and what they include</title>
<style>rect{{fill:#fff;stroke:#555}}.verb{{fill:#e8f0fa}}.seam{{fill:#fff3d6}}
text{{font:14px monospace;text-anchor:middle;fill:#111}}path{{fill:none;stroke:#777;marker-end:url(#tip)}}</style>
<defs><marker id="tip" viewBox="0 0 6 6" refX="1" refY="3" markerWidth="6" markerHeight="6" orient="auto">
<path d="M0 0L6 3L0 6z" style="fill:#777;stroke:none;marker-end:none"/></marker></defs>
<rect x="0" y="0" width="{page}" height="{height}" style="stroke:none"/>
{chr(10).join(shapes)}
</svg>
"""
stale = "--check" in sys.argv and (not target.exists() or target.read_text() != drawing)
if not stale:
    target.write_text(drawing)
print(*[f"upwards: {u}" for u in upwards], *(["docs/figures/architecture.svg is not up to date"] if stale else []), sep="\n")
sys.exit(bool(upwards or stale))
