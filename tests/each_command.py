#!/usr/bin/env python3
"""Runs every command of the program once, on a shipped study, and checks its exit code, a word of its output, and
that no line of it or of its help is wider than a terminal of 80 columns.

    each_command.py <tiltrim> <source tree>

For sanitizers, under which the tests of the command line take too long; those check the output in full.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import time

program, source = sys.argv[1], pathlib.Path(sys.argv[2])
studies = source / "studies"
MAPPED = studies / "map_corridor.toml"

# Command, arguments, exit code (1: a condition without answer), a word of its output.
COMMANDS = [
    ("trim", [studies / "paper.toml"], 0, "converged"),
    ("trim", [studies / "stall.toml", "--all", "--starts", "20"], 0, "descent"),
    ("linearize", [studies / "paper.toml"], 0, "participation"),
    ("linearize", [studies / "paper.toml", "--format", "json"], 0, '"verdict"'),
    ("modes", [studies / "boeing747.csv"], 0, "stable"),
    ("follow", [studies / "stall.toml", "--only", "level"], 0, "fold"),
    ("envelope", [studies / "stall.toml", "--only", "level", "--count", "12"], 0, "boundary"),
    ("linearize", [studies / "levitation.toml"], 0, "gap + speed"),
    ("sensitivities", [studies / "paper.toml", "--only", "level", "--most", "3"], 0, "decay rate"),
    ("margins", [studies / "paper.toml", "--only", "level"], 0, "gain up"),
    ("qualities", [studies / "boeing747.toml"], 0, "anticipation"),
    ("loads", [studies / "xv15_loads.toml"], 0, "horizontal_tail"),
    ("validate", ["xv15"], 0, "Kleinhesselink"),
    ("sweep", [MAPPED, "-o", "one.nc"], 0, ""),
    ("sweep", [MAPPED, "-o", "two.nc", "--threads", "2"], 0, ""),
    ("diff", ["one.nc", "two.nc"], 0, ""),
    ("sweep", [studies / "map_verdict.toml", "-o", "first.nc", "--part", "1/2"], 0, "part 1 of 2"),
    ("sweep", [studies / "map_verdict.toml", "-o", "second.nc", "--part", "2/2"], 0, "part 2 of 2"),
    ("merge", ["first.nc", "second.nc", "-o", "merged.nc"], 0, "216345 stable"),
    ("tune", [studies / "tune_paper.toml", "--evaluations", "40"], None, "tuned"),
    ("simulate", [studies / "transition_reference.toml"], None, "h"),
    ("simulate", [studies / "paper.toml", "--response", "gamma_deg=1", "--only", "level"], 0, "differ"),
    ("simulate", [studies / "levitation.toml"], 0, "t"),
    ("prove", ["short.toml", "--certificate", "short.proof"], 0, "proved_stable"),
    ("check-proof", ["short.proof", "--study", "short.toml"], 0, "compared"),
    ("check-proof", ["short.proof", "--study", "longer.toml"], 1, "the range of 'h' is not that of the study"),
    ("check-proof", ["short.proof", "--study", "margin.toml"], 1, "the margin is less than that of the study"),
    ("check-proof", ["short.proof", "--study", studies / "scheduled.toml"], 0, "file's"),
    ("report", ["brief.toml", "-o", "brief.html"], None, ""),
    ("tables", [], 0, "Table 3"),
    ("completion", ["bash"], 0, "complete -o"),
    ("manual", ["sweep"], 0, "SYNOPSIS"),
]

NOT_TO_READ = ("completion", "manual")  # scripts, for other programs

told = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
offered = set(re.findall(r"^  ([a-z-]+) {2,}", told.split("Subcommands:")[1].split("Examples:")[0], re.M))
faults = [f"{name}: not run here" for name in offered - {name for name, *_ in COMMANDS}]
COMMANDS += [(name, ["--help"], 0, "Usage") for name in sorted(offered)]

# A proof over a short stretch of the corridor; the checker may be missing in this build.
whole = (studies / "prove_corridor.toml").read_text()
SHORT = whole.replace("from = 0\n", "from = 60\n").replace("to = 120\n", "to = 62\n")
assert SHORT != whole
# A report without the tables' audit, which `tables` makes here, and without a flight.
BRIEF = (studies / "paper.toml").read_text() + '[report]\naudit = "skip"\nflight = "skip"\n'

with tempfile.TemporaryDirectory() as folder:
    for short, text in (("short", SHORT), ("longer", SHORT.replace("to = 62", "to = 63")),
                        ("margin", SHORT.replace("margin = 0.0", "margin = 0.1")), ("brief", BRIEF)):
        pathlib.Path(folder, f"{short}.toml").write_text(text)
    for name, arguments, code, word in COMMANDS:
        begun = time.monotonic()
        run = subprocess.run([program, name, *map(str, arguments)], cwd=folder, capture_output=True, text=True)
        print(f"{name}: exit code {run.returncode}, {len(run.stdout)} characters, {time.monotonic() - begun:.1f} s")
        if name == "check-proof" and "built without" in run.stderr:
            continue
        expected = (0, 1) if code is None else (code,)
        wide = [line for line in run.stdout.splitlines() if len(line) > 80]
        if wide and "json" not in arguments and (name not in NOT_TO_READ or "--help" in arguments):
            faults.append(f"{name} {arguments}: a line of {len(max(wide, key=len))} characters\n{wide[0]}")
        if run.returncode not in expected or word not in run.stdout:
            faults.append(f"{name} {arguments}: exit code {run.returncode}\n{run.stdout[-2000:]}{run.stderr[-2000:]}")

print(*faults, sep="\n")
sys.exit(bool(faults))
