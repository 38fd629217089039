#!/usr/bin/env python3
"""Runs every shipped study through every command that takes it, in every format, and keeps the output.

    every_study.py <tiltrim> <source tree> <folder>

Compare two folders with `diff -r` before and after a change that must not change results. Searches and
Monte-Carlo runs are cut short; version numbers and run times are left out.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

program, source, folder = (pathlib.Path(a).absolute() for a in sys.argv[1:4])
studies = sorted((source / "studies").glob("*.toml"))
FORMATS = ["text", "json", "csv", "markdown", "latex"]
# Commands that take a study: name, further arguments, formats, and a word of the study it needs.
COMMANDS = [
    ("trim", [], FORMATS, ""),
    ("trim", ["--all", "--starts", "20"], ["text", "json"], ""),
    ("linearize", [], FORMATS, ""),
    ("linearize", ["--jacobian", "differences", "--models", "models.json"], ["json"], ""),
    ("follow", ["--parameter", "aircraft.mass", "--to", "4.5"], ["json"], ""),
    ("follow", [], FORMATS, "[follow]"),
    ("follow", ["--parameter", "V", "--to", "12"], FORMATS, ""),
    ("envelope", ["--count", "9"], FORMATS, ""),
    ("envelope", ["--over", "gamma_deg", "--count", "7"], ["json"], ""),
    ("sensitivities", [], FORMATS, ""),
    ("margins", ["--bode", "bode.csv"], FORMATS, ""),
    ("qualities", [], FORMATS, ""),
    ("loads", [], FORMATS, "xv15"),
    ("prove", ["--certificate", "box.proof"], FORMATS, "[[prove.parameter]]"),
    ("sweep", ["-o", "map.nc"], ["text"], "[[sweep.axis]]"),
    ("sweep", [], ["text", "json", "csv"], "[[sweep.axis]]"),
    ("tune", ["--evaluations", "60", "--gains", "gains.toml"], FORMATS, "[tune]"),
    ("simulate", ["--samples", "flight.csv"], FORMATS, ""),
    ("simulate", ["--samples", "flight.nc"], ["text"], ""),
    ("simulate", ["--monte-carlo"], ["text", "json", "csv"], "[montecarlo]"),
    ("simulate", ["--flight", "3"], ["json"], "[montecarlo]"),
    ("simulate", ["--tilt-rate-limit"], ["text", "json"], "corridor"),
    ("simulate", ["--response", "gamma=0.05"], ["text", "json"], ""),
    ("report", ["-o", "page.html", "--figures", "figures", "--tables", "tables"], [""], ""),
]
ALONE = [["modes", source / "studies/boeing747.csv", "--format", f] for f in FORMATS] + \
        [["tables", "--format", f] for f in FORMATS] + \
        [["validate", "xv15", "--format", f] for f in FORMATS]
LONG = {"sweep": {"map_corridor_two_gains", "map_two_gains"}, "report": {"tune_corridor", "tune_transition", "map_two_gains"}}


def runs():
    for study in studies:
        text = study.read_text()
        for command, arguments, formats, needs in COMMANDS:
            if needs not in text or study.stem in LONG.get(command, ()):
                continue
            for form in formats:
                place = folder / study.stem / "_".join([command, *(a.strip("-") for a in arguments[:2]), form]).replace("/", "_")
                yield place, [command, study, *arguments, *(["--format", form] if form else [])]
    for arguments in ALONE:
        yield folder / "alone" / f"{arguments[0]}_{arguments[-1]}", arguments


def run(work):
    place, arguments = work
    place.mkdir(parents=True, exist_ok=True)
    done = subprocess.run([program, *map(str, arguments)], cwd=place, capture_output=True, timeout=900)
    for name, written in (("out", done.stdout), ("err", done.stderr)):
        words = re.sub(rb"(in |after )?[0-9.]+ m?s \((of|on)[^)]*\)|\b[0-9.]+ (s|ms|us)\b(?=[^\n]*(thread|core))", b"TIME", written)
        words = re.sub(rb'"(seconds|program|version)": [^,\n]*', b'"\\1": ...', words)
        (place / name).write_bytes(words.replace(str(source).encode(), b"SOURCE"))
    for figure in place.rglob("*.pdf"):  # which gnuplot dates
        figure.write_bytes(re.sub(rb"/CreationDate[^\n]*", b"", figure.read_bytes()))
    for page in place.glob("*.html"):  # its command names the study
        page.write_bytes(page.read_bytes().replace(str(source).encode(), b"SOURCE"))
    (place / "code").write_text(f"{done.returncode}\n")


with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    for k, _ in enumerate(pool.map(run, runs())):
        pass
print(k + 1, "runs")
