#!/usr/bin/env python3
"""tiltrim.modes() beside numpy.linalg.eig on the same matrices, CPU time, each in turn.

  modes_numpy.py [--matrices 5]     a row for each kind of matrix, its ratios at n = 12, 25, 50, 100

Eigenvalues, eigenvectors on both sides, conditions and error bounds over numpy's eigenvalues and
right eigenvectors: the median over the matrices of the least time of each.
"""

import argparse
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # where numpy's LAPACK has threads
import numpy as np  # noqa: E402
import tiltrim  # noqa: E402

SIZES = (12, 25, 50, 100)
AT_LEAST = 0.1  # s for each function and matrix
FEWEST = 5  # calls of each


def gaussian(random, n):
    return random.standard_normal((n, n))


def oscillators(random, n):
    """Masses, springs and dampers under feedback from every state, as most closed loops look."""
    half, rest = n // 2, n % 2
    A = np.zeros((n, n))
    A[:half, half : 2 * half] = np.eye(half)
    A[half : 2 * half, :half] = -np.diag(random.uniform(1, 100, half))
    A[half : 2 * half, half : 2 * half] = -np.diag(random.uniform(0.1, 2, half))
    A[half : 2 * half, :] += random.standard_normal((half, 1)) @ random.standard_normal((1, n)) / n
    A[n - rest :, :] = -random.uniform(0.1, 1, (rest, n))
    return A


def block_triangular(random, n):
    """Blocks of 1 to 6 states, each driven by those after it."""
    A = np.triu(random.standard_normal((n, n))) / n**0.5
    at = 0
    while at < n:
        end = min(n, at + random.integers(1, 7))
        A[at:end, at:end] = random.standard_normal((end - at, end - at))
        at = end
    return A


def ratio(A):
    """Least time of modes() over that of eig(), called alternately."""
    functions = (tiltrim.modes, np.linalg.eig)
    least, spent, calls = [float("inf")] * 2, 0.0, 0
    while spent < 2 * AT_LEAST or calls < FEWEST:
        for i, function in enumerate(functions):
            begun = time.process_time_ns()
            function(A)
            taken = 1e-9 * (time.process_time_ns() - begun)
            least[i], spent = min(least[i], taken), spent + taken
        calls += 1
    return least[0] / least[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--matrices", type=int, default=5)
    matrices = parser.parse_args().matrices
    print(f"{'modes() over eig()':20}" + "".join(f"{f'n = {n}':>10}" for n in SIZES))
    for kind in (gaussian, oscillators, block_triangular):
        random = np.random.default_rng(1)
        medians = [np.median([ratio(kind(random, n)) for _ in range(matrices)]) for n in SIZES]
        print(f"{kind.__name__.replace('_', ' '):20}" + "".join(f"{r:10.2f}" for r in medians))


if __name__ == "__main__":
    main()
