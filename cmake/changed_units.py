#!/usr/bin/env python3
"""The sources of a build that read one of the changed files, itself or through what it includes: what clang-tidy looks at.

    changed_units.py <build folder> [changed file...]      without files: all sources
"""
import json
import pathlib
import re
import sys

root = pathlib.Path(__file__).resolve().parents[1]
build, changed = pathlib.Path(sys.argv[1]), {(root / name).resolve() for name in sys.argv[2:]}
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.M)
read = {}


def reads(file):
    """The file and all of the project that it includes."""
    found, waiting = set(), [file]
    while waiting:
        one = waiting.pop()
        if one in found:
            continue
        found.add(one)
        if one not in read:
            read[one] = [place for name in INCLUDE.findall(one.read_text())
                         for place in (root / name, one.parent / name, pathlib.Path(name)) if place.is_file()]
        waiting += read[one]
    return found


units = sorted({entry["file"] for entry in json.loads((build / "compile_commands.json").read_text())})
for unit in units:
    if "_verify_interface_header_sets" not in unit and (not changed or changed & reads(pathlib.Path(unit))):
        print(unit)
