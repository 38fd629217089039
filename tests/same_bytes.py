#!/usr/bin/env python3
"""A map has the same bytes whatever instruction set computed it.

    same_bytes.py <tiltrim> <study>

Under an emulator: TILTRIM_RUN="qemu-x86_64 -cpu Haswell" runs the program in it, once with the best set that the
emulated processor has, and compares that map with those of this processor, too.
"""
import os
import shlex
import subprocess
import sys
import tempfile

program, study = sys.argv[1:3]
emulator = shlex.split(os.environ.get("TILTRIM_RUN", ""))


def sweep(folder, instruction_set, run=()):
    """The map's bytes; None where the processor lacks the set."""
    environment = {k: v for k, v in os.environ.items() if k != "TILTRIM_SIMD"}
    if instruction_set:
        environment["TILTRIM_SIMD"] = instruction_set
    file = os.path.join(folder, "map.nc")
    done = subprocess.run([*run, program, "sweep", study, "-o", file], env=environment, capture_output=True, text=True)
    if "TILTRIM_SIMD is" in done.stderr:
        return None
    if done.returncode != 0:
        sys.exit(f"{instruction_set or 'default'}: exit code {done.returncode}\n{done.stderr}")
    with open(file, "rb") as written:
        content = written.read()
    os.remove(file)
    return content


with tempfile.TemporaryDirectory() as folder:
    maps = {name: sweep(folder, name) for name in ("scalar", "baseline", "avx2", "avx512")}
    maps = {name: content for name, content in maps.items() if content is not None}
    if emulator:
        maps[" ".join(emulator)] = sweep(folder, "", emulator)

first = maps["scalar"]
others = [name for name, content in maps.items() if content != first]
print(f"{len(first)} bytes by", ", ".join(maps))
if "baseline" not in maps or others:
    sys.exit(f"other bytes by: {', '.join(others)}")
