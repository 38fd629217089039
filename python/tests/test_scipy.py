"""From random starts: fewer failures than scipy.optimize.root, and none reported as a success.

A smaller case of bench/python_scipy.py, which has the times."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("scipy")
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
import python_scipy  # noqa: E402


@pytest.mark.parametrize("name", ["tiltrotor", "planar VTOL", "light aircraft"])
def test_fewer_failures_than_root(name):
    answers = python_scipy.compare(name, python_scipy.prepared()[name], 66)
    failed, wrong, *_ = answers["tiltrim"]
    assert wrong == 0
    assert failed < answers["scipy.optimize.root"][0]
    assert failed <= 1


def test_the_overhead_is_printed():
    import python_overhead

    said = subprocess.run(
        [sys.executable, python_overhead.__file__, "--seconds", "0"],
        check=True, capture_output=True, text=True,
    ).stdout.splitlines()  # fmt: skip
    assert [line[:8] for line in said[1:]] == ["built in", "returns ", "returns ", "the tilt"]
    assert all(line.count(" µs") == 1 for line in said[1:])
