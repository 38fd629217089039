#!/usr/bin/env python3
"""Cost of a call from C++ to a Python function, compared with the built-in model.

  python_overhead.py [--seconds 1]     one line for each model: time of an evaluation, and the ratio

Each flies the tiltrotor's closed loop near a trim with steps of the same length, so that an
evaluation is the integrator's own work and one call of f.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python/tests"))
import tiltrim  # noqa: E402
from written_models import Tiltrotor  # noqa: E402


def evaluation(model, start, seconds):
    """Seconds for an evaluation: the least of several runs, together at least `seconds` long."""
    least, spent = float("inf"), 0.0
    while spent <= seconds:
        begun = time.perf_counter()
        flown = tiltrim.simulate(model, start, 20.0, sample=20.0, longest_step=0.01)
        taken = time.perf_counter() - begun
        assert flown, flown
        least, spent = min(least, taken / flown.evaluations), spent + taken
    return least


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=1.0)
    seconds = parser.parse_args().seconds
    built_in = tiltrim.tiltrotor().model
    start = tiltrim.trim(tiltrim.tiltrotor()).point.replace(theta=0.03)
    signals = {"states": built_in.states, "parameters": built_in.parameters}
    zeros = [0.0] * 6
    own = Tiltrotor()
    models = {
        "built in": built_in,
        "returns a list of six": tiltrim.Model("empty", lambda x, u, p: zeros, **signals),
        "returns an array": tiltrim.Model("empty", lambda x, u, p: x, **signals),
        "the tiltrotor in Python": tiltrim.Model("written", own.rates, **signals),
    }
    base = None
    print(f"{'f':26}{'an evaluation':>15}{'over built in':>15}")
    for name, model in models.items():
        if name == "returns an array":
            begin = start.replace({s.name: 0.0 for s in built_in.states})
        else:
            begin = start
        taken = evaluation(model, begin, seconds)
        base = base or taken
        print(f"{name:26}{1e6 * taken:12.2f} µs{taken / base:15.1f}")


if __name__ == "__main__":
    main()
