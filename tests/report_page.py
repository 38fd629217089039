#!/usr/bin/env python3
"""Opens the pages that `tiltrim report` makes in a browser: report_page.py PROGRAM SOURCE_FOLDER

They must agree with the program's other commands, be readable, and treat every name as plain
text. With axe-core (TILTRIM_AXE=axe.min.js) accessibility is checked, too. Exit code 0: all as
expected; 1: not; 77: no Chromium, chromedriver, selenium or gnuplot (skipped).
"""

import base64
import collections
import csv
import itertools
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import numpy

sys.dont_write_bytecode = True
import colour_vision  # noqa: E402
from packages import need, skip  # noqa: E402

need("python3-selenium", "selenium")
from selenium import webdriver  # noqa: E402
from selenium.common.exceptions import NoAlertPresentException  # noqa: E402
from selenium.webdriver.chrome.service import Service  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402

TESTS = pathlib.Path(__file__).resolve().parent
SCRIPT = (TESTS / "report_page.js").read_text(encoding="utf-8")
NUMBER = r"(-?\d[\d.]*(?:e[-+]?\d+)?)"


# ---- The program and the browser -----------------------------------------------------------------

def run(program, *arguments, codes=(0, 1)):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, encoding="utf-8")
    if done.returncode not in codes:
        raise RuntimeError(f"{arguments}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def browser(profile):
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                 "--hide-scrollbars", "--window-size=1200,1000", f"--user-data-dir={profile}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    driver.set_script_timeout(600)  # on a machine under load
    return driver


def ask(driver, call, *arguments):
    return driver.execute_script(f"{SCRIPT}\nreturn {call}(...arguments);", *arguments)


def look(driver, scheme="light", media="", width=1200):
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
        "media": media, "features": [{"name": "prefers-color-scheme", "value": scheme}]})
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
        "width": width, "height": 1000, "deviceScaleFactor": 1, "mobile": False})


def opened(driver, page):
    for log in ("performance", "browser"):
        driver.get_log(log)  # empties it
    look(driver)
    driver.get(page.resolve().as_uri())
    return ask(driver, "data")


# ---- Numbers -------------------------------------------------------------------------------------

def same(shown, value):
    """Is the text `shown` the number to six digits?"""
    if value == 0:
        return float(shown) == 0
    half = 0.5 * 10 ** (math.floor(math.log10(abs(value))) - 5)
    return abs(float(shown) - value) <= half * (1 + 1e-4)


def pixel(axis, low, high, value):
    """Place on an axis that goes from pixel `low` to pixel `high`; None outside."""
    f = math.log if axis["log"] else lambda v: v
    share = (f(value) - f(axis["lower"])) / (f(axis["upper"]) - f(axis["lower"]))
    return low + share * (high - low) if -1e-9 <= share <= 1 + 1e-9 else None


def place(panel, x, y):
    left, right, top, bottom = panel["area"]
    across, up = pixel(panel["x"], left, right, x), pixel(panel["y"], bottom, top, y)
    return None if across is None or up is None else (across, up)


def number_at(point, key):
    """Value of a curve's key at a point of `sweep -f json`; ζ and ω from re and im."""
    mode = re.fullmatch(r"(re|im|zeta|omega)_(\d+)", key)
    if not mode:
        known = {**point["state"], **point["input"]}
        return math.degrees(known[key[:-4]]) if key.endswith("_deg") else known[key]
    re_, im = (point["modes"][int(mode[2])][part] for part in ("re", "im"))
    omega = math.hypot(re_, im)
    return {"re": re_, "im": abs(im), "omega": omega, "zeta": -re_ / omega if omega else None}[mode[1]]


def named(things, name):
    return next(t for t in things if t["name"] == name)


# ---- As it is opened -----------------------------------------------------------------------------

def check_quiet(driver, page):
    for entry in driver.get_log("browser"):
        if entry["level"] in ("WARNING", "SEVERE"):
            yield f"console: {entry['message']}"
    for entry in driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            if url != page.resolve().as_uri() and not url.startswith("data:"):
                yield f"asks for {url}"


def check_drawn(driver, data):
    figures = ask(driver, "figures")
    if [f["name"] for f in data["figures"]] != sorted((f["name"] for f in figures), key=[f["name"] for f in data["figures"]].index):
        yield "the figures drawn are not those of the data"
    for f in figures:
        if f["paths"] < 3:
            yield f"{f['name']}: nothing is drawn"
        if f["beyond"] > 1:
            yield f"{f['name']}: {f['part']} lies {f['beyond']:.1f} px outside"
        if f["role"] != "img" or not f["label"].strip():
            yield f"{f['name']}: no name for those who do not see it"
    yield from (f"words on words: {words}" for words in ask(driver, "overlaps"))
    yield from (f"words on a curve: {words}" for words in ask(driver, "covered"))


def check_structure(driver):
    found = ask(driver, "structure")
    if found["repeated"]:
        yield f"ids that are not alone: {found['repeated']}"
    if found["unnamed"]:
        yield f"{found['unnamed']} tables without caption or label"
    if found["links"]:
        yield f"links to nowhere: {found['links']}"
    if found["scripts"] != 2 or found["images"] != 0:
        yield f"{found['scripts']} scripts and {found['images']} images, expected 2 and 0"
    levels = [level for level, _ in found["headings"]]
    if levels[0] != 1 or levels.count(1) != 1 or any(b > a + 1 for a, b in zip(levels, levels[1:])):
        yield f"headings out of order: {found['headings']}"


def check_labels(driver, data):
    found = ask(driver, "uprights")
    for figure in data["figures"]:
        if not figure["name"].startswith("participation") and found[figure["name"]] != len(figure["panels"]):
            yield f"{figure['name']}: {found[figure['name']]} labels of {len(figure['panels'])} vertical axes"


def check_cut(driver, scrolled=()):
    for media, width in (("print", 717), ("", 1400)):  # A4 with Chromium's margins
        look(driver, media=media, width=width)
        yield from (f"{media} {width} px: the table {table} is cut" for table in ask(driver, "cut") if table not in scrolled)


def check_widths(driver, data):
    for width in (1400, 800, 400):
        look(driver, width=width)
        if ask(driver, "structure")["wide"] > 0:
            yield f"a window of {width} px has to be scrolled sideways"
        locus = next(f["name"] for f in data["figures"] if f["name"].startswith("locus_slow"))
        if not pointed(driver, locus, 300, 300)["inside"]:
            yield f"in a window of {width} px a tip is cut off"
        driver.switch_to.active_element.send_keys(Keys.ESCAPE)
        if ask(driver, "tip", locus)["visible"]:
            yield "Escape does not take a tip away"
        pointed(driver, locus, 310, 290)  # one is there when the page is printed
    look(driver)


# ---- Sliders -------------------------------------------------------------------------------------

def with_axes(source, folder, axes):
    """The study with these numbers along each axis, as [[sweep.axis]]."""
    text = (source / "studies/paper.toml").read_text(encoding="utf-8")
    for key, values, log in axes:
        text += f'\n[[sweep.axis]]\nkey = "{key}"\n'
        text += f'from = {values[0]!r}\nto = {values[-1]!r}\ncount = {len(values)}\nspacing = "log"\n' if log else f"values = {values}\n"
    study = folder / f"sweep_{len(axes)}.toml"
    study.write_text(text, encoding="utf-8")
    return study


def swept(program, source, folder, axes):
    return json.loads(run(program, "sweep", with_axes(source, folder, axes), "--only", "climb", "-f", "json"))["points"]


def on_line(points, at):
    """Distance of a place from a line of moves and strokes."""
    best = math.inf
    for (_, x0, y0), (what, x1, y1) in zip(points, points[1:]):
        if what != "L":
            continue
        length = (x1 - x0) ** 2 + (y1 - y0) ** 2
        t = min(1, max(0, ((at[0] - x0) * (x1 - x0) + (at[1] - y0) * (y1 - y0)) / length)) if length else 0
        best = min(best, math.hypot(at[0] - x0 - t * (x1 - x0), at[1] - y0 - t * (y1 - y0)))
    return best


def check_markers(driver, figure, point, parameter):
    panels = ask(driver, "markers", figure["name"], [len(p["curves"]) for p in figure["panels"]])
    lines = ask(driver, "lines", figure["name"])
    for panel, found in zip(figure["panels"], panels):
        for curve, circle in zip(panel["curves"], found["circles"]):
            x = parameter if curve["x"] == "parameter" else number_at(point, curve["x"])
            expected = place(panel, x, number_at(point, curve["y"]))
            where = f"{figure['name']}, {curve['y']} at {parameter}"
            if (circle is None) != (expected is None):
                yield f"{where}: marker {circle}, expected at {expected}"
            elif circle and math.dist(circle["at"], expected) > 0.1:
                yield f"{where}: marker at {circle['at']}, expected {expected}"
            elif circle and on_line(lines[circle["colour"]], circle["at"]) > 0.3:
                yield f"{where}: the marker is not on the line drawn"
        if panel["x"]["key"] == "parameter":
            left, right = panel["area"][:2]
            if found["cursors"][0] is None or abs(found["cursors"][0] - pixel(panel["x"], left, right, parameter)) > 0.1:
                yield f"{figure['name']}: vertical line at {found['cursors'][0]} for {parameter}"


def check_output(rows, track, point, parameter):
    if not same(re.fullmatch(rf"h = {NUMBER} m", rows[0])[1], parameter):
        yield f"{rows[0]}: expected {parameter}"
    pairs = [pair for m in range(len(point["modes"])) if (pair := pair_of(point, m))[0] == m]
    if len(rows) != 1 + len(pairs):
        yield f"at {parameter}: {len(rows) - 1} rows for {len(pairs)} eigenvalues and pairs"
    for row, pair in zip(rows[1:], pairs):
        found = re.fullmatch(mode_words(track, pair), row)
        expected = [number_at(point, f"{part}_{pair[0]}") for part in ("re", "im", "zeta", "omega")]
        if not found or not all(map(same, (f or "0" for f in found.groups()), expected)):
            yield f"at {parameter}: \"{row}\", expected {expected}"


def pair_of(point, m):
    """The mode, or it and the one that is complex conjugate to it."""
    modes = point["modes"]
    return [k for k in range(len(modes)) if k == m or modes[m]["im"] != 0
            and math.isclose(modes[k]["re"], modes[m]["re"], rel_tol=1e-9) and math.isclose(modes[k]["im"], -modes[m]["im"], rel_tol=1e-9)]


def mode_words(track, pair):
    name = ", ".join(str(m + 1) for m in pair) + " " + "; ".join(dict.fromkeys(track["modes"][m] for m in pair))
    return rf"{re.escape(name)}: λ {NUMBER}(?: ± {NUMBER}i)?, ζ {NUMBER}, ω {NUMBER} rad/s"


def check_track(driver, data, points):
    track = next(t for t in data["tracks"] if t["modes"])
    heights = [p["h"] for p in points]
    grid = data["grids"][0]
    slider = driver.find_element("css selector", f'.controls[data-track="{track["name"]}"] input')
    last = len(heights) - 1
    moves = [([Keys.END], last), ([Keys.ARROW_LEFT] * 3, last - 3), ([Keys.HOME], 0), ([Keys.ARROW_RIGHT] * 7, 7),
             ([Keys.PAGE_UP] * 4 + [Keys.ARROW_UP] * 2, None), ([Keys.PAGE_UP] * 2 + [Keys.ARROW_DOWN], None)]
    seen = set()
    for keys, expected in moves:
        slider.send_keys(*keys)
        i = int(slider.get_property("value"))
        seen.add(i)
        if expected not in (None, i):
            yield f"the slider stands at {i}, expected {expected}"
        for figure in data["figures"]:
            if figure["track"] == track["name"]:
                yield from check_markers(driver, figure, points[i], heights[i])
            elif any(p["map"] == grid["name"] for p in figure["panels"]):
                panel = figure["panels"][0]
                near = min(grid["x"]["values"], key=lambda h: abs(h - heights[i]))
                at = ask(driver, "markers", figure["name"], [0])[0]["cursors"][0]
                if at is None or abs(at - pixel(panel["x"], *panel["area"][:2], near)) > 0.1:
                    yield f"{figure['name']}: vertical line at {at} for h = {heights[i]}"
        yield from check_output(ask(driver, "output", "track", track["name"]), track, points[i], heights[i])
    if len(seen) != len(moves):
        yield f"the slider came to {sorted(seen)} only"


# ---- Pointer -------------------------------------------------------------------------------------

def pointed(driver, figure, x, y):
    """The lines of the tip when the pointer stands at x, y of the figure."""
    across, down = ask(driver, "place", figure, x, y)
    driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": across, "y": down})
    return ask(driver, "tip", figure)


def check_tip(driver, figure, at, patterns, values):
    tip = pointed(driver, figure["name"], *at)
    where = f"{figure['name']} at {[round(v, 1) for v in at]}"
    if not tip["visible"] or not tip["inside"] or len(tip["lines"]) != len(patterns):
        yield f"{where}: tip {tip}"
        return
    for line, pattern, expected in zip(tip["lines"], patterns, values):
        found = re.fullmatch(pattern, line)
        if not found or not all(map(same, (f or "0" for f in found.groups()), expected)):
            yield f"{where}: \"{line}\", expected {expected}"


def check_locus(driver, data, points):
    track = next(t for t in data["tracks"] if t["modes"])
    for figure in data["figures"]:
        if not figure["name"].startswith("locus"):
            continue
        panel = figure["panels"][0]
        spots = {(i, m): place(panel, mode["re"], abs(mode["im"])) for i, p in enumerate(points) for m, mode in enumerate(p["modes"])}
        spots = {key: at for key, at in spots.items() if at}
        # Points that stand alone, so that there is no doubt which one is meant.
        x, y = numpy.array(list(spots.values())).T
        near = numpy.hypot(x[:, None] - x, y[:, None] - y) < 1.5
        alone = [key for key, count in zip(spots, near.sum(axis=1)) if count == 1]
        for i, m in alone[:: max(1, len(alone) // 4)]:
            mode = mode_words(track, [m])
            values = [number_at(points[i], f"{part}_{m}") for part in ("re", "im", "zeta", "omega")]
            yield from check_tip(driver, figure, spots[i, m], [rf"h = {NUMBER} m", mode], [[points[i]["h"]], values])
        if len(alone) < 4:
            yield f"{figure['name']}: {len(alone)} points stand alone"


def check_trim_tips(driver, data, points):
    figure = next(f for f in data["figures"] if f["name"].startswith("trim"))
    for panel, i in itertools.product(figure["panels"], (20, len(points) // 2, len(points) - 30)):
        key = panel["curves"][0]["y"]
        at = place(panel, points[i]["h"], number_at(points[i], key))
        yield from check_tip(driver, figure, at, [rf"h = {NUMBER} m", rf"\D\S* {NUMBER}°?"], [[points[i]["h"]], [number_at(points[i], key)]])


def check_map(driver, data, points):
    grid = data["grids"][0]
    figure = next(f for f in data["figures"] if any(p["map"] == grid["name"] for p in f["panels"]))
    rows = len(grid["y"]["values"])
    if len(points) != rows * len(grid["x"]["values"]):
        yield f"the map has {rows * len(grid['x']['values'])} points, sweep {len(points)}"
    for k in (7, len(points) // 3 + 11, len(points) // 2 - 20, 3 * len(points) // 7, len(points) - 9):
        point = points[k]
        words = rf"{point['verdict']}, largest Re λ {NUMBER} 1/s"
        yield from check_tip(driver, figure, place(figure["panels"][0], point["h"], point["gains.K_Lp"]),
                             [rf"h = {NUMBER} m", rf"K_Lp = {NUMBER}", words],
                             [[point["h"]], [point["gains.K_Lp"]], [point["spectral_abscissa"]]])


def beyond_rounding(values, i):
    """A number as the page shows it: 0 if it is rounding next to the largest."""
    return values[i] if abs(values[i]) >= 1e-9 * max(map(abs, values)) else 0


def check_tips_along(driver, figure, parameter, tables):
    """The pointer over each panel's curves; tables: key -> numbers along the parameter."""
    for panel in figure["panels"]:
        for i in range(len(tables[parameter]) // 7, len(tables[parameter]), len(tables[parameter]) // 3):
            shown = [beyond_rounding(tables[c["y"]], i) for c in panel["curves"]]
            x = tables[parameter if panel["curves"][0]["x"] == "parameter" else panel["curves"][0]["x"]][i]
            words = rf".*?(?:^|\s|= ){NUMBER}(?:°| dB| m/s| m| rad/s| s| N| W)?"
            yield from check_tip(driver, figure, place(panel, x, shown[0]), [words] * (1 + len(shown)),
                                 [[tables[parameter][i]]] + [[v] for v in shown])


def check_bode(driver, data, program, source, folder):
    run(program, "margins", source / "studies/paper.toml", "--bode", folder / "bode.csv")
    tables = collections.defaultdict(lambda: collections.defaultdict(list))
    with open(folder / "bode.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            of = tables[row["name"]]
            if float(row["frequency"]) not in of["parameter"]:
                of["parameter"].append(float(row["frequency"]))
            of[row["actuator"] + "_dB"].append(float(row["magnitude_dB"]))
            of[row["actuator"] + "_phase_deg"].append(float(row["phase_deg"]))
    for figure in data["figures"]:
        if figure["name"].startswith("bode"):
            yield from check_tips_along(driver, figure, "parameter", tables[figure["name"].split("_", 2)[2]])


def check_flight(driver, data, program, source):
    rows = list(csv.DictReader(run(program, "simulate", source / "studies/paper.toml", "-f", "csv").splitlines()))
    table = {key: [float(row[key]) for row in rows] for key in rows[0]}
    table["parameter"] = table["time"]
    for figure in data["figures"]:
        if figure["name"].startswith("flight") and figure["name"] != "flight_path":
            yield from check_tips_along(driver, figure, "parameter", table)
    at_start = next((text for text in ask(driver, "readouts") if text.startswith("time = 0 s")), "no flight")
    if re.search(r"e-\d\d|no flight", at_start):
        yield f"rounding is shown at the start of the flight: {at_start}"


# ---- For every reader ----------------------------------------------------------------------------

def check_readable(driver):
    for scheme in ("light", "dark"):
        look(driver, scheme)
        yield from (f"{scheme}: {words}" for words in ask(driver, "faint"))
        yield from (f"{scheme}: {words}" for words in colours_too_near(**ask(driver, "palette")))
    look(driver)


def colours_too_near(colours, paper):
    """Pairs of the six curve colours that are too similar, for any colour vision."""
    curves = colours[1:7]
    for k, colour in enumerate(curves, 1):
        if colour_vision.contrast(colour, paper) < 3:
            yield f"curve colour {k} has contrast {colour_vision.contrast(colour, paper):.2f} against the page"
    for (j, a), (k, b) in itertools.combinations(enumerate(curves, 1), 2):
        for vision in colour_vision.VISIONS:
            if colour_vision.difference(a, b, vision) < 10:
                yield f"curve colours {j} and {k} differ by {colour_vision.difference(a, b, vision):.1f} ({vision})"


def check_keyboard(driver):
    stops = ask(driver, "stops")
    driver.execute_script("document.querySelector('.skip').focus();")
    for k in range(1, stops):
        driver.switch_to.active_element.send_keys(Keys.TAB)
        at = ask(driver, "focused")
        if at["body"]:
            yield f"Tab comes to {k} of {stops} places"
            return
        if not at["outlined"] or at["contrast"] < 3:
            yield f"where the keyboard is cannot be seen: {at}"


def axe():
    found = pathlib.Path(os.environ.get("TILTRIM_AXE", TESTS.parent / "node_modules/axe-core/axe.min.js"))
    return found.read_text(encoding="utf-8") if found.is_file() else None


def check_axe(driver):
    rules = axe()
    if not rules:
        print("axe-core is not there: its rules are not checked")
        return
    for scheme, width in (("light", 1200), ("dark", 1200), ("light", 400)):
        look(driver, scheme, width=width)
        driver.execute_script(rules)
        found = driver.execute_async_script(
            "const done = arguments[0]; axe.run({ runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] })"
            ".then((r) => done(r.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.length} times, ${v.nodes[0].html.slice(0, 150)}`)));")
        yield from (f"{scheme}, {width} px: axe: {words}" for words in found)
    look(driver)


def check_print(driver):
    closed = ask(driver, "closed")
    sheet = base64.b64decode(driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    if not sheet.startswith(b"%PDF-") or sheet.count(b"/Type /Page\n") + sheet.count(b"/Type /Page ") < 2:
        yield "nothing is printed"
    if closed == 0 or ask(driver, "closed"):
        yield "details stay closed when printed"
    look(driver, media="print")
    for selector in ("nav", "input[type=range]", ".skip", ".tip", ".cursor", ".marker", "output"):
        if ask(driver, "visible", selector):
            yield f"{selector} is printed"
    look(driver, "dark", "print")
    if min(ask(driver, "palette")["paper"]) < 1:
        yield "a dark page is printed"
    yield from (f"printed: {words}" for words in ask(driver, "faint"))
    look(driver)


# ---- Names that are more than names --------------------------------------------------------------

HOSTILE = ["<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "a_b%c$d#e{f}^~\\", "'; DROP", "θ–π “quotes” 漢字",
           "</script><script>alert(2)</script>", "{{7*7}}${alert(3)}", "<!--"]
HOSTILE_FILE = "a b & 'c' <d> \"e\" #% ü.toml"


def write_hostile(folder):
    def condition(name, numbers):
        return f"[[condition]]\nname = {json.dumps(name, ensure_ascii=False)}\n{numbers}\n"
    flights = itertools.cycle(["V = 2.0\ngamma_deg = 90.0\neta_deg = 90.0", "V = 15.0\ngamma_deg = 0.0\neta_deg = 0.0"])
    text = "".join(condition(name, next(flights)) for name in HOSTILE)
    text += condition("too steep <b>", "V = 15.0\ngamma_deg = 80.0\neta_deg = 0.0")
    text += '[report]\naudit = "skip"\nflight = "skip"\n[[report.map]]\n[[report.map.axis]]\nkey = "h"\nfrom = 0\nto = 120\ncount = 25\n'
    text += ('[[report.map]]\n[[report.map.axis]]\nkey = "h"\nfrom = 0\nto = 120\ncount = 13\n'
             '[[report.map.axis]]\nkey = "gains.K_Lp"\nfrom = 0.05\nto = 5\ncount = 9\nspacing = "log"\n')
    study = folder / HOSTILE_FILE
    study.write_text(text, encoding="utf-8")
    return study


def check_names(driver):
    heads = driver.execute_script("return [...document.querySelectorAll('[data-table=conditions] tbody th')].map((e) => e.textContent);")
    if heads != HOSTILE + ["too steep <b>"]:
        yield f"the conditions are called {heads}"
    said = driver.execute_script("""return [...document.querySelectorAll('svg[data-figure^=participation]')].map((svg) =>
        [svg.closest('figure').querySelector('figcaption').textContent, svg.getAttribute('aria-label')]);""")
    if len(said) != len(HOSTILE):
        yield f"{len(said)} figures of shares, expected {len(HOSTILE)}"
    for name, (caption, _) in zip(HOSTILE, said):
        if name not in caption:
            yield f"the caption \"{caption}\" does not say {name}"
    bode = driver.execute_script("return [...document.querySelectorAll('svg[data-figure^=bode]')].map((svg) => svg.getAttribute('aria-label'));")
    yield from (f"the name \"{label}\" does not say {name}" for name, label in zip(HOSTILE, bode) if name not in label)
    if driver.title != HOSTILE_FILE + ": tiltrim report" or driver.find_element("tag name", "h1").text != HOSTILE_FILE:
        yield f"the page is called \"{driver.title}\""
    if driver.execute_script("return document.querySelectorAll('main b').length") > 0:
        yield "a name acts as markup"


def check_unanswered(driver):
    first = driver.execute_script("""const part = document.querySelector('main section');
        return [part.querySelector('h2').textContent, [...part.querySelectorAll('dt')].map((e) => [e.textContent, e.nextElementSibling.textContent])];""")
    if first[0] != "Unanswered, and why":
        yield f"\"{first[0]}\" stands first"
    why = [reason for what, reason in first[1] if "too steep <b>" in what]
    if not why or "infeasible" not in why[0] or not re.search(r"limit|needs|cannot|without", why[0]) or len(why[0]) < 60:
        yield f"the reason is {why}"
    if "too steep <b>" not in driver.find_element("id", "verdict").text:
        yield "the verdict does not name what has no answer"


def check_no_alert(driver):
    try:
        yield f"an alert: {driver.switch_to.alert.text}"
    except NoAlertPresentException:
        pass


# ---- All -----------------------------------------------------------------------------------------

def misses_of_paper(driver, program, source, folder):
    page = folder / "paper.html"
    run(program, "report", source / "studies/paper.toml", "-o", page, codes=(0,))
    if page.stat().st_size > 5_000_000:
        yield f"the page has {page.stat().st_size} bytes"
    data = opened(driver, page)
    yield from check_drawn(driver, data)
    yield from check_structure(driver)
    yield from check_labels(driver, data)
    heights = next(t for t in data["tracks"] if t["modes"])["columns"][0]["values"]
    grid = data["grids"][0]
    line = swept(program, source, folder, [("h", heights, False)])
    plane = swept(program, source, folder, [("h", grid["x"]["values"], False), ("gains.K_Lp", grid["y"]["values"], True)])
    yield from check_track(driver, data, line)
    yield from check_locus(driver, data, line)
    yield from check_trim_tips(driver, data, line)
    yield from check_map(driver, data, plane)
    yield from check_bode(driver, data, program, source, folder)
    yield from check_flight(driver, data, program, source)
    yield from check_readable(driver)
    yield from check_keyboard(driver)
    yield from check_widths(driver, data)
    yield from check_cut(driver)
    yield from check_print(driver)
    yield from check_quiet(driver, page)
    yield from check_axe(driver)


def misses_of_user_model(driver, program, source, folder):
    page = folder / "levitation.html"
    run(program, "report", source / "studies/levitation.toml", "-o", page)
    data = opened(driver, page)
    yield from check_drawn(driver, data)
    yield from check_structure(driver)
    yield from check_labels(driver, data)
    yield from check_readable(driver)
    yield from check_widths(driver, data)
    yield from check_cut(driver)
    yield from check_axe(driver)
    yield from check_quiet(driver, page)


def misses_of_hostile(driver, program, folder):
    study = write_hostile(folder)
    page = folder / (HOSTILE_FILE + ".html")
    run(program, "report", study, "-o", page, codes=(1,))
    data = opened(driver, page)
    yield from check_no_alert(driver)
    yield from check_drawn(driver, data)
    yield from check_structure(driver)
    yield from check_names(driver)
    yield from check_unanswered(driver)
    yield from check_widths(driver, data)
    yield from check_cut(driver, scrolled=["margins"])  # names of 34 letters without a blank
    yield from check_quiet(driver, page)


ZERO = """[model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1.0
[[condition]]
name = "held"
x = 0.0
u = "free"
[[report.map]]
[[report.map.axis]]
key = "a"
values = [0.0, 1e-15, 1.0, 2.0]
"""


def misses_of_zero(driver, program, folder):
    """An eigenvalue of zero, or of rounding next to the others, has no damping ratio."""
    study, page = folder / "zero.toml", folder / "zero.html"
    study.write_text(ZERO, encoding="utf-8")
    run(program, "report", study, "-o", page)
    opened(driver, page)
    slider = driver.find_element("css selector", ".controls input")
    slider.send_keys(Keys.HOME)
    for expected in ("λ 0, ζ –, ω 0 rad/s", "ζ –", "ζ 1"):
        words = ask(driver, "readouts")[0]
        if expected not in words:
            yield f"the slider says {words}, not {expected}"
        slider.send_keys(Keys.ARROW_RIGHT)


def main():
    for tool in ("chromium", "chromedriver", "gnuplot"):
        if not shutil.which(tool):
            skip(tool)
    program, source = sys.argv[1], pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        driver = browser(folder / "profile")
        try:
            missed = 0
            for miss in itertools.chain(misses_of_paper(driver, program, source, folder),
                                        misses_of_user_model(driver, program, source, folder),
                                        misses_of_hostile(driver, program, folder),
                                        misses_of_zero(driver, program, folder)):
                print(miss, flush=True)
                missed += 1
        finally:
            driver.quit()
    print(f"{missed} misses" if missed else "the pages show what they should")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
