#!/usr/bin/env python3
"""data/output.schema.json, the JSON that the commands print, has every key and type that they print.

    output_schema.py <tiltrim> <source tree>

With TILTRIM_WRITE=1 it is written, from all shipped studies, which takes some minutes; without, it is compared with a
part of them. A key that the code writes and no shipped study brings about must be among RARE.
"""

import concurrent.futures
import functools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
program, source = sys.argv[1], pathlib.Path(sys.argv[2])
FILE = source / "data/output.schema.json"
WRONG_INPUT = 2
WRITE = os.environ.get("TILTRIM_WRITE")

# What is described: its arguments, and a word of the studies it needs.
COMMANDS = {
    "trim": ([], ""),
    "trim --all": (["--starts", "20"], ""),
    "linearize": ([], ""),
    "follow": ([], ""),
    "envelope": (["--count", "5"], ""),
    "sensitivities": ([], ""),
    "margins": ([], ""),
    "loads": ([], "xv15"),
    "qualities": ([], "[qualities]"),
    "prove": (["--boxes", "60"], "[prove]"),
    "sweep": ([], "[[sweep.axis]]"),
    "tune": (["--evaluations", "30"], "[tune]"),
    "simulate": ([], ""),
    "simulate --monte-carlo": ([], "[montecarlo]"),
    "simulate --tilt-rate-limit": ([], "corridor"),
    "simulate --response": (["gamma_deg=1"], ""),
}
LONG = {"envelope": {"corridor", "stall"}, "sweep": {"map_corridor_gain", "map_corridor_two_gains", "map_two_gains", "scheduled"}}
# Enough of them for every command; all are run for TILTRIM_WRITE.
QUICK = {"airframe", "levitation", "map_corridor", "paper", "stall", "transition", "tune_paper", "xv15_loads"}
# A study that has a diagnosis; the only ones of their commands.
ALSO = {("trim", "printed"), ("qualities", "boeing747"), ("prove", "prove_reference")}
# A model that throws; a switch that a motion crosses; several goals; a proof of no trim; a schedule in a certificate.
RARE = {"first", "rising", "goals", "exclude", "y", "schedule"}
# Objects that have a value for each name of the model or of the study.
BY_NAME = {"state", "input", "output", "parameter", "rates", "participation", "units", "samples", "error", "gains",
           "scattered", "at", "linear", "nonlinear", "ends", "components"}  # fmt: skip


def printed(command, *arguments):
    """The JSON of a command, or None if it does not take the study."""
    words = command.split()
    run = subprocess.run([program, words[0], *words[2:], *map(str, arguments[:1]), *words[1:2], *map(str, arguments[1:]),
                          "--format", "json"], capture_output=True, text=True)  # fmt: skip
    assert run.returncode in (0, 1, WRONG_INPUT), f"{command} {arguments}: {run.returncode} {run.stderr}"
    return None if run.returncode == WRONG_INPUT else json.loads(run.stdout)


def studied(folder):
    """Commands and their arguments over the shipped studies."""
    for study in sorted((source / "studies").glob("*.toml")):
        text = study.read_text()
        if "[montecarlo]" in text:  # a few flights have the keys of ten thousand
            study = folder / study.name
            study.write_text(re.sub(r"^flights = .*", "flights = 8", text, flags=re.MULTILINE))
        for command, (arguments, needs) in COMMANDS.items():
            quick = study.stem in QUICK or (command, study.stem) in ALSO
            if needs in text and study.stem not in LONG.get(command, ()) and (WRITE or quick):
                yield command, study, *arguments


def compared(folder, more=""):
    """Two maps that differ."""
    levitation = (source / "studies/levitation.toml").read_text() + more
    for name, mass in (("before", "0.1"), ("after", "0.11")):
        study = folder / f"{name}.toml"
        study.write_text(re.sub(r'(name = "mass".*?value = )[0-9.]+', rf"\g<1>{mass}", levitation, flags=re.DOTALL))
        subprocess.run([program, "sweep", study, "-o", folder / f"{name}.nc"], capture_output=True, check=False)
        yield folder / f"{name}.nc"


def runs():
    """(command, its JSON)"""
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        singular = folder / "singular.csv"  # an eigenvalue of 0 but for rounding: its damping is not determined
        singular.write_text("1,2,3\n4,5,6\n7,8,9\n")
        work = [*studied(folder), ("modes", source / "studies/boeing747.csv"), ("modes", singular), ("validate", "xv15"),
                ("tables",), ("diff", *compared(folder))]  # fmt: skip
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            yield from zip([w[0] for w in work], pool.map(lambda w: printed(*w), work))
        yield "diff of verdicts", printed("diff", *compared(folder, '\n[sweep]\ndetail = "verdict"\n'))
        printed("linearize", source / "studies/paper.toml", "--models", folder / "paper.json")
        yield "linearize --models FILE.json", json.loads((folder / "paper.json").read_text())
        printed("prove", source / "studies/prove_reference.toml", "--boxes", "60", "--damping", "0.01",
                "--certificate", folder / "certificate")  # fmt: skip
        for line in (folder / "certificate").read_text().splitlines():
            yield "prove --certificate FILE, each line", json.loads(line)


def names_of(answer):
    """The keys of an object, or of one in it, that are names: of a branch's parameter, of a map's axes, of a table's rows."""
    found = {answer[key] for key in ("parameter", "over") if isinstance(answer.get(key), str)}
    found.update(column["key"] for axis in answer.get("axes", []) for column in [axis, *axis["columns"]] if "key" in column)
    found.update(axis["name"] for axis in answer.get("axes", []))
    if "pieces" in answer:
        found.update(set(answer) - {"status", "evaluations", "rows", "pieces", "count"})
    if "notes" in answer:
        found.update(set(answer) - {"title", "notes"})
    return found


def merge(a, b):
    """The schema of what is either."""
    types = sorted({*a["type"], *b["type"]})
    if "integer" in types and "number" in types:
        types.remove("integer")
    both = {"type": types}
    for part in ("items", "additionalProperties"):
        if found := [s[part] for s in (a, b) if part in s]:
            both[part] = merge(*found) if len(found) == 2 else found[0]
    if "properties" in a or "properties" in b:
        ours, theirs = a.get("properties", {}), b.get("properties", {})
        both["properties"] = {key: merge(ours[key], theirs[key]) if key in ours and key in theirs else ours.get(key) or theirs[key]
                              for key in [*ours, *(k for k in theirs if k not in ours)]}  # fmt: skip
    return both


KINDS = {bool: "boolean", int: "integer", float: "number", str: "string", type(None): "null"}


def learned(answer, names=frozenset(), key=""):
    """The schema of a value; `names` are keys that name something of the study."""
    if isinstance(answer, list):
        plain = {type(part): part for part in answer if not isinstance(part, (dict, list))}
        kinds = [learned(part, names) for part in [*plain.values(), *(p for p in answer if isinstance(p, (dict, list)))]]
        return {"type": ["array"], **({"items": functools.reduce(merge, kinds)} if kinds else {})}
    if not isinstance(answer, dict):
        return {"type": [KINDS[type(answer)]]}
    names = names | names_of(answer)
    schema = {"type": ["object"]}
    for name, value in answer.items():
        kind = learned(value, names, name)
        if (key in BY_NAME and "status" not in answer) or name in names:
            schema["additionalProperties"] = merge(schema.get("additionalProperties", kind), kind)
        else:
            schema.setdefault("properties", {})[name] = kind
    return schema


def keys_of(schema):
    for name, value in schema.get("properties", {}).items():
        yield name
        yield from keys_of(value)
    for part in ("items", "additionalProperties"):
        if part in schema:
            yield from keys_of(schema[part])


def keys_in_code():
    """The keys that the functions of report/ write which make JSON."""
    found = set()
    of_the_page = ("figure", "page", "study_", "user_columns")
    for file in sorted(f for f in (source / "report").glob("*.cpp") if not f.name.startswith(of_the_page)):
        for function in re.findall(r"^[^\s#}/].*?^}", file.read_text(), re.DOTALL | re.MULTILINE):
            if "ordered_json" in function:  # with a further text it is a column of a table
                found.update(a or b for a, b in re.findall(r'\["(\w+)"\]|\{\s*"(\w+)",(?!\s*(?:"|Tone))', function))
    return found


def differing(known, schema, path=""):
    """The paths at which a schema has what the other has not."""
    found = [path] if set(merge(known, schema)["type"]) != set(known["type"]) else []
    for name, value in schema.get("properties", {}).items():
        inner = known.get("properties", {}).get(name)
        found += differing(inner, value, f"{path}.{name}") if inner else [f"{path}.{name}"]
    for part, word in (("items", "[]"), ("additionalProperties", ".*")):
        if part in schema:
            found += differing(known[part], schema[part], path + word) if part in known else [path + word]
    return found


def full(schema):
    """The inverse of simple()."""
    if isinstance(schema, dict):
        return {key: [value] if key == "type" and isinstance(value, str) else full(value) for key, value in schema.items()}
    return schema


def simple(schema):
    """One type as a word instead of a list of one."""
    if isinstance(schema, dict):
        return {key: value[0] if key == "type" and len(value) == 1 else simple(value) for key, value in schema.items()}
    return schema


commands = {}
for command, answer in runs():
    if answer is not None:
        commands[command] = merge(commands[command], learned(answer)) if command in commands else learned(answer)
print(len(commands), "commands,", sum(len(list(keys_of(c))) for c in commands.values()), "keys")
if WRITE:
    schema = {"$schema": "http://json-schema.org/draft-07/schema#", "title": "what tiltrim's commands print as JSON",
              "definitions": simple(dict(sorted(commands.items())))}  # fmt: skip
    FILE.write_text(json.dumps(schema, indent=1) + "\n")
known = full(json.loads(FILE.read_text())["definitions"])
for command, schema in commands.items():
    assert command in known, f"{command} is not in {FILE.name}"
    assert merge(known[command], schema) == known[command], f"{command}: {differing(known[command], schema)}"
missing = keys_in_code() - {key for command in known.values() for key in keys_of(command)}
assert missing == RARE, f"in the code alone: {missing - RARE}; not rare: {RARE - missing}"
