import json
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def fail_if_skipped(report):
    """If TILTRIM_NO_SKIP is set, skipped tests fail."""
    if os.environ.get("TILTRIM_NO_SKIP") and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped, and TILTRIM_NO_SKIP is set: {report.longrepr}"


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport():
    fail_if_skipped((yield).get_result())


@pytest.hookimpl(hookwrapper=True)
def pytest_make_collect_report():
    fail_if_skipped((yield).get_result())


@pytest.fixture(scope="session")
def studies():
    return ROOT / "studies"


@pytest.fixture(scope="session")
def program():
    """program("trim", study, ...): the JSON output of `tiltrim trim study ... --format json`."""
    path = os.environ.get("TILTRIM_PROGRAM", str(ROOT / "build/bin/tiltrim"))

    def run(*words):
        command = [path, *map(str, words), "--format", "json"]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        return json.loads(done.stdout)

    return run
