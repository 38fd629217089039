#!/usr/bin/env python3
"""Gains with the fastest decay: tiltrim tune, from the program and from Python, and
scipy.optimize.differential_evolution on the same problem.

  tune_scipy.py [--first 1] [--seeds 10] [--generations 600] [--program build/bin/tiltrim]

The three studies of bench/tuning/ limit damping and frequency. Their trim does not move with the
gains, and the system matrix is affine in each gain or its reciprocal: the parts come from
linearize() once, so that a candidate costs SciPy no more than numpy.linalg.eigvals. It has as many
candidates as tiltrim (population of 15 for each gain) and the limits as its own constraints.
"""

import argparse
import json
import resource
import subprocess
import time
import tomllib
from pathlib import Path

import numpy as np
import tiltrim
from scipy.optimize import NonlinearConstraint, differential_evolution

HERE = Path(__file__).resolve().parent
RECIPROCAL = {"T_w"}


class Bare:
    """A study as SciPy sees it: variables in [0, 1] in, eigenvalues out."""

    def __init__(self, file):
        tune = tomllib.loads(file.read_text())["tune"]
        self.limits = {limit["measure"]: limit for limit in tune["limit"]}
        self.names = [gain["key"] for gain in tune["gain"]]
        self.lower = np.array([gain["from"] for gain in tune["gain"]])
        self.upper = np.array([gain["to"] for gain in tune["gain"]])
        self.linear = np.array([gain.get("spacing") == "linear" for gain in tune["gain"]])
        self.power = np.array([-1.0 if name in RECIPROCAL else 1.0 for name in self.names])
        condition = next(iter(tiltrim.read_study(file).conditions.values()))
        self.model, self.point = condition.model, tiltrim.trim(condition).point
        self.fixed, self.parts = self.matrix(self.lower), []
        enters = self.entering(self.lower)
        for j, upper in enumerate(self.upper):
            gains = self.lower.copy()
            gains[j] = upper
            self.parts.append(
                (self.matrix(gains) - self.fixed) / (self.entering(gains) - enters)[j]
            )
        self.fixed = self.fixed - np.tensordot(enters, self.parts, 1)
        middle = self.gains(np.full(len(self.names), 0.5))
        assert np.allclose(self.affine(middle), self.matrix(middle), rtol=1e-9, atol=1e-9)
        self.last = None, None

    def matrix(self, gains):
        """By tiltrim."""
        point = self.point.replace(dict(zip(self.names, gains)))
        return tiltrim.linearize(self.model, point).A

    def entering(self, gains):
        return gains**self.power

    def affine(self, gains):
        return self.fixed + np.tensordot(self.entering(gains), self.parts, 1)

    def gains(self, y):
        ratio = np.where(self.linear, 1.0, self.upper / np.where(self.linear, 1.0, self.lower))
        return np.where(
            self.linear, self.lower + y * (self.upper - self.lower), self.lower * ratio**y
        )

    def eigenvalues(self, y):
        """Goal and constraints ask for the same y in turn."""
        if self.last[0] != y.tobytes():
            self.last = y.tobytes(), np.linalg.eigvals(self.affine(self.gains(y)))
        return self.last[1]

    def decay(self, y):
        return -self.eigenvalues(y).real.max()

    def limited(self, y):
        found = self.eigenvalues(y)
        measures = {"damping": (-found.real / abs(found)).min(), "frequency": abs(found).max()}
        return [measures[name] for name in self.limits]

    def constraint(self):
        ends = [(one.get("at_least", -np.inf), one.get("at_most", np.inf))
                for one in self.limits.values()]  # fmt: skip
        return NonlinearConstraint(self.limited, *np.array(ends).T)


def by_scipy(bare, seed, generations):
    found = differential_evolution(
        lambda y: -bare.decay(y), [(0, 1)] * len(bare.names), seed=seed, maxiter=generations,
        popsize=15, tol=1e-10, polish=False, constraints=bare.constraint(),
    )  # fmt: skip
    return -float(np.ravel(found.fun)[0]) if np.max(found.maxcv) <= 1e-9 else -np.inf


def by_program(program, file, seed):
    command = [program, "tune", file, "--seed", str(seed), "--format", "json"]
    printed = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    return printed["goal"]["value"]


def cpu():
    """Of this process with its threads, and of the programs it has run."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=1, help="seed")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--generations", type=int, default=600)
    parser.add_argument("--program", default=str(HERE.parent / "build/bin/tiltrim"))
    arguments = parser.parse_args()
    for file in sorted((HERE / "tuning").glob("*.toml")):
        bare, study = Bare(file), tiltrim.read_study(file)
        searches = {
            "tiltrim tune": lambda seed: by_program(arguments.program, file, seed),
            "tiltrim.tune()": lambda seed: tiltrim.tune(study, seed=seed).goal,
            "differential_evolution": lambda seed: by_scipy(bare, seed, arguments.generations),
        }
        goals, seconds = {name: [] for name in searches}, dict.fromkeys(searches, 0.0)
        for seed in range(arguments.first, arguments.first + arguments.seeds):
            for name, search in searches.items():  # in turn: a busy machine is as slow for each
                begun = cpu()
                goals[name].append(search(seed))
                seconds[name] += cpu() - begun
        assert goals["tiltrim tune"] == goals["tiltrim.tune()"]  # the same bits
        best = max(max(values) for values in goals.values())
        print(f"{file.stem}: decay over the best of all, {best:.5f} 1/s; {arguments.seeds} seeds")
        print(f"  {'':24}{'best':>9}{'median':>9}{'worst':>9}{'within 0.1 %':>14}{'CPU':>7}")
        for name, values in goals.items():
            ratios = np.array(values) / best
            found = f"{np.sum(ratios >= 0.999)} of {len(values)}"
            cost = seconds[name] / seconds["differential_evolution"]
            spread = "".join(
                f"{r:9.4f}" if np.isfinite(r) else f"{'none':>9}"
                for r in (ratios.max(), np.median(ratios), ratios.min())
            )
            print(f"  {name:24}{spread}{found:>14}{cost:7.2f}", flush=True)


if __name__ == "__main__":
    main()
