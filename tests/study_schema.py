#!/usr/bin/env python3
"""data/study.schema.json accepts every shipped study, and refuses every wrong study that a JSON schema can: all but those
whose mistake is in one of the classes below.

    study_schema.py <model_tests> <source tree>

model_tests writes the wrong studies of its tests into the folder that TILTRIM_REFUSED names, each under its message.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib

sys.dont_write_bytecode = True
from packages import need  # noqa: E402

(jsonschema,) = need("python3-jsonschema", "jsonschema")
program, source = sys.argv[1], pathlib.Path(sys.argv[2])

# What no schema of draft 7 can express, by the readers' messages.
BEYOND_A_SCHEMA = {
    "a name that is elsewhere in the study": (
        "report.map.condition: '.*' is not known|simulate.start: '.*' is not known|is not a condition of the study|"
        "is of formulation|has no control law|is commanded with|flies a commanded speed|is also the name of|"
        "is the name of an earlier condition|"
        "is given twice|is set twice|is free in|depends on the tilt"
    ),
    "two values that are compared": (
        "is not below upper|is not above `from`|is `from` again|repeats it|reverses the direction|not in ascending order|"
        r"values for \d+ |samples; expected at most|simulate.sample: \d+ is out of range|which decreases to|"
        r"is not before the end|the condition (fixes|does not vary)"
    ),
    "arithmetic": "makes 1 [+] |is not positive at one|percent: .*(reaches|changes nothing|is 0, so)",
    "files": "aircraft.polar",
    "a number that JSON has not": "nan is not finite",
}

schema = jsonschema.Draft7Validator(json.loads((source / "data/study.schema.json").read_text()))
for study in sorted((source / "studies").glob("*.toml")):
    wrong = [f"{'/'.join(map(str, e.path))}: {e.message}" for e in schema.iter_errors(tomllib.loads(study.read_text()))]
    assert not wrong, f"{study.name} is refused: {wrong}"

refused, unexplained = 0, []
accepted = dict.fromkeys(BEYOND_A_SCHEMA, 0)
with tempfile.TemporaryDirectory() as folder:
    tests = [program, "--source-file=*study_test.cpp,*user_model_test.cpp"]
    subprocess.run(tests, env={**os.environ, "TILTRIM_REFUSED": folder}, check=True, stdout=subprocess.DEVNULL)
    for file in sorted(pathlib.Path(folder).iterdir()):
        message, text = file.read_text(errors="surrogateescape").split("\n", 1)
        try:
            study = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, UnicodeError, RecursionError):
            continue  # no TOML at all
        if not schema.is_valid(study):
            refused += 1
            continue
        reasons = [why for why, words in BEYOND_A_SCHEMA.items() if re.search(words, message)]
        for why in reasons:
            accepted[why] += 1
        if len(reasons) != 1:
            unexplained.append(f"{message}: {reasons or 'no class'}")
print(f"{refused} wrong studies refused; accepted:", *(f"{n} {why}" for why, n in accepted.items()), sep="\n  ")
print(*unexplained, sep="\n")
assert not unexplained and all(accepted.values()) and refused >= 840
