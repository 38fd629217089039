import json
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def studies():
    return ROOT / "studies"


@pytest.fixture(scope="session")
def program():
    """program("trim", study, ...): what `tiltrim trim study ... --format json` says."""
    path = os.environ.get("TILTRIM_PROGRAM", str(ROOT / "build/bin/tiltrim"))

    def run(*words):
        command = [path, *map(str, words), "--format", "json"]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        return json.loads(done.stdout)

    return run
