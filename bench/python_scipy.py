#!/usr/bin/env python3
"""Equilibria and eigenvalues from random starts: tiltrim and scipy.optimize.root and
numpy.linalg.eigvals, on the same Python functions.

  python_scipy.py [--starts 1000]     a table for each of three models

A start is a random place within the bounds of the unknowns. Each condition has an equilibrium.

  failed : no point within the bounds whose rates, evaluated again, are below 1e-8 in nominal sizes
  wrong  : of those, success was reported all the same

trim(others=False) starts from there and, while that leads to none, from up to 32 further places.
root() has the start alone, and in the row "restarted" up to 32 further random places, each answer
verified here by hand. Both then differentiate and take eigenvalues, tiltrim's with bounds of their
errors: the times are of the equilibrium alone, and with them.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import root

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python/tests"))
import tiltrim  # noqa: E402
from written_models import problems_with_an_equilibrium  # noqa: E402

VERIFIED = 1e-8  # of a held rate over its nominal size, 1/s
FURTHER = 32
BLOCK = 50  # starts of one solver before the next one has its turn


class Bare:
    """A problem as root() sees it: unknowns z in, the rates that are to vanish out."""

    def __init__(self, problem):
        model, spec, self.at = problem.model, problem.spec, problem.guess
        self.names = list(spec.free)
        self.f, self.h = FUNCTIONS[model.name]
        self.x, self.u, self.p = self.at.x.copy(), self.at.u.copy(), self.at.p
        states = [s.name for s in model.states]
        inputs = [s.name for s in model.inputs]
        self.slots = [
            (self.x, states.index(n)) if n in states else (self.u, inputs.index(n))
            for n in self.names
        ]
        self.steady = [i for i, s in enumerate(model.states) if s.name in spec.steady]
        self.nominal = np.array([s.nominal for s in model.states])
        outputs = [s.name for s in model.outputs]
        self.bounds = {n: spec.bounds[n] for n in self.names}
        self.output_bounds = [
            (outputs.index(n), b) for n, b in spec.bounds.items() if n not in self.names
        ]

    def put(self, z):
        for (vector, i), value in zip(self.slots, z):
            vector[i] = value

    def residual(self, z):
        self.put(z)
        rates = self.f(self.x, self.u, self.p)
        return [rates[i] for i in self.steady]

    def verified(self, z):
        """Whether z is an equilibrium within the bounds: evaluated anew."""
        if not np.all(np.isfinite(z)):
            return False
        slack = 1e-9
        for value, (lower, upper) in zip(z, self.bounds.values()):
            if not lower - slack <= value <= upper + slack:
                return False
        rates = np.array(self.residual(z)) / self.nominal[self.steady]
        if not np.max(abs(rates)) < VERIFIED:
            return False
        if self.output_bounds:
            outputs = self.h(self.x, self.u, self.p)
            return all(b[0] - slack <= outputs[i] <= b[1] + slack for i, b in self.output_bounds)
        return True

    def random(self, generator):
        return np.array([generator.uniform(*bound) for bound in self.bounds.values()])

    def eigenvalues(self, z):
        """Of the matrix of central differences."""
        self.put(z)
        A = np.empty((self.x.size, self.x.size))
        for j in range(self.x.size):
            step = 6e-6 * self.nominal[j]
            x = self.x.copy()
            x[j] += step
            ahead = np.array(self.f(x, self.u, self.p))
            x[j] -= 2 * step
            A[:, j] = (ahead - np.array(self.f(x, self.u, self.p))) / (2 * step)
        return np.linalg.eigvals(A)


def by_scipy(bare, z0, generator, further):
    """(success reported, answer) of root() from z0, and from `further` random places."""
    answer, success = z0, False
    for attempt in range(1 + further):
        try:
            found = root(bare.residual, z0 if attempt == 0 else bare.random(generator))
        except (ArithmeticError, ValueError):  # the model's own, far away
            continue
        answer, success = found.x, bool(found.success)
        if success and (further == 0 or bare.verified(answer)):
            break
    return success, answer, lambda: bare.eigenvalues(answer)


def by_tiltrim(problem, bare, z0):
    guess = problem.guess.replace(dict(zip(bare.names, z0)))
    held = tiltrim.trim(problem.model, guess, spec=problem.spec, others=False, starts=FURTHER)
    answer = np.array([held[name] for name in bare.names])
    return bool(held), answer, lambda: tiltrim.modes(tiltrim.linearize(problem.model, held.point))


FUNCTIONS = {}


def compare(model, problems, starts, seed=1):
    """{solver: (failed, wrong, seconds, with eigenvalues)} over random starts, the problems in
    turn."""
    solvers = {
        "tiltrim": lambda problem, bare, z0, g: by_tiltrim(problem, bare, z0),
        "scipy.optimize.root": lambda problem, bare, z0, g: by_scipy(bare, z0, g, 0),
        "the same, restarted": lambda problem, bare, z0, g: by_scipy(bare, z0, g, FURTHER),
    }
    bares = [Bare(problem) for problem in problems]
    generators = {name: np.random.default_rng(seed + 1) for name in solvers}
    counts = {name: [0, 0, 0.0, 0.0] for name in solvers}
    generator = np.random.default_rng(seed)
    places = [bares[k % len(bares)].random(generator) for k in range(starts)]
    for first in range(0, starts, BLOCK):  # in turn: a busy machine is as slow for each
        block = range(first, min(first + BLOCK, starts))
        for name, solve in solvers.items():
            begun = time.process_time()
            answers = [
                solve(problems[k % len(problems)], bares[k % len(bares)], places[k], generators[name])
                for k in block
            ]
            solved = time.process_time()
            for success, _, eigenvalues in answers:
                if success:
                    eigenvalues()
            counts[name][2] += solved - begun
            counts[name][3] += time.process_time() - begun
            for k, (success, z, _) in zip(block, answers):
                good = bares[k % len(bares)].verified(z)
                counts[name][0] += not (good and success)
                counts[name][1] += success and not good
    return {name: tuple(count) for name, count in counts.items()}


def prepared():
    """The problems of the three models, their functions noted for root()."""
    from written_models import Tiltrotor, aircraft_rates, vtol_rates

    own = Tiltrotor()
    FUNCTIONS["tiltrotor, written"] = (own.rates, own.outputs)
    FUNCTIONS["planar VTOL"] = (vtol_rates, None)
    FUNCTIONS["light aircraft"] = (aircraft_rates, None)
    return problems_with_an_equilibrium()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=1000)
    arguments = parser.parse_args()
    for model, problems in prepared().items():
        answers = compare(model, problems, arguments.starts)
        print(f"{model}: {len(problems)} conditions, {arguments.starts} random starts")
        print(f"  {'':22}{'failed':>8}{'wrong':>8}{'each':>10}{'tiltrim over it':>18}{'all':>10}")
        _, _, trimmed, whole = answers["tiltrim"]
        for solver, (failed, wrong, alone, both) in answers.items():
            each = f"{1e3 * alone / arguments.starts:.3f} ms"
            ratios = f"{trimmed / alone:18.2f}{whole / both:10.2f}"
            print(f"  {solver:22}{failed:8}{wrong:8}{each:>10}{ratios}")


if __name__ == "__main__":
    main()
