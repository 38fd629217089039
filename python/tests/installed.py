"""installed.py SOURCE BUILD SCRATCH: pip install into a fresh environment, without network, from a
build folder; then runs a program far from both."""

import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

PROGRAM = """
import os
import tiltrim

here = os.path.dirname(tiltrim.__file__)
assert here.startswith({scratch!r}), here
assert tiltrim.data_directory() == os.path.join(here, "data"), tiltrim.data_directory()
held = tiltrim.trim(tiltrim.tiltrotor(V=15.0))
study = tiltrim.read_study(os.path.join(here, "studies", "paper.toml"))
verdicts = [tiltrim.modes(condition).verdict for condition in study.conditions.values()]
print(held.status, tiltrim.__version__, *verdicts)
"""


def main(source, build, scratch):
    try:
        import ensurepip  # noqa: F401  Debian has it in python3-venv
        import numpy  # noqa: F401
    except ModuleNotFoundError as missing:
        if missing.name not in ("ensurepip", "numpy"):
            raise
        print(f"skipped: {missing}")
        return 1 if os.environ.get("TILTRIM_NO_SKIP") else 77
    shutil.rmtree(scratch, ignore_errors=True)
    elsewhere = Path(scratch, "elsewhere")
    elsewhere.mkdir(parents=True)
    venv.create(Path(scratch, "env"), with_pip=True, system_site_packages=True)
    python = Path(scratch, "env/bin/python")
    own = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "TILTRIM_DATA")}
    pip = [python, "-m", "pip", "install", "--no-index", "--disable-pip-version-check", source]
    subprocess.run(pip, check=True, env={**own, "TILTRIM_BUILD": build})
    program = PROGRAM.format(scratch=str(Path(scratch).resolve()))
    said = subprocess.run(
        [python, "-c", program], check=True, cwd=elsewhere, env=own, capture_output=True, text=True
    ).stdout
    shutil.rmtree(scratch)
    print(said)
    assert said == "converged 0.1.0 stable stable stable\n", said
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
