#!/usr/bin/env python3
"""data/study.schema.json accepts every shipped study, and refuses most studies that the readers refuse for a key, a
type or a range: six of seven. The others need another key (the range of the number that an axis sweeps, names of
conditions) or hold a NaN, which JSON has not.

    study_schema.py <model_tests> <source tree>

model_tests writes the wrong studies of its tests into the folder that TILTRIM_REFUSED names, each under its message.
No schema can detect contradictions between keys (a condition that does not exist, two equal names).
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import tomllib

sys.dont_write_bytecode = True
from packages import need  # noqa: E402

(jsonschema,) = need("python3-jsonschema", "jsonschema")
program, source = sys.argv[1], pathlib.Path(sys.argv[2])
OF_ONE_KEY = ("unknown key", "is not a number", "is out of range", "is not finite", "is not text", "is not a table",
              "is not a list", "is not known", "is not a whole number", "is not a value")  # fmt: skip

schema = jsonschema.Draft7Validator(json.loads((source / "data/study.schema.json").read_text()))
for study in sorted((source / "studies").glob("*.toml")):
    wrong = [f"{'/'.join(map(str, e.path))}: {e.message}" for e in schema.iter_errors(tomllib.loads(study.read_text()))]
    assert not wrong, f"{study.name} is refused: {wrong}"

with tempfile.TemporaryDirectory() as folder:
    tests = [program, "--source-file=*study_test.cpp,*user_model_test.cpp"]
    subprocess.run(tests, env={**os.environ, "TILTRIM_REFUSED": folder}, check=True, stdout=subprocess.DEVNULL)
    refused = accepted = others = 0
    for file in sorted(pathlib.Path(folder).iterdir()):
        message, text = file.read_text(errors="surrogateescape").split("\n", 1)
        try:
            study = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, UnicodeError, RecursionError):
            continue  # no TOML at all
        valid = schema.is_valid(study)
        if not any(words in message for words in OF_ONE_KEY):
            others += 1
            continue
        refused += not valid
        accepted += valid
print(f"{refused} of {refused + accepted} wrong keys, types and ranges refused; {others} studies contradict themselves elsewhere")
sys.exit(0 if refused >= 600 and refused > 6 * accepted else 1)
