#!/usr/bin/env python3
"""Trims, spectra and proofs whose truth is known by construction, in any number; prints the wrong results.

    planted.py <folder of the programs> [trims] [spectra] [proofs] [processes]

A million trims, 100,000 spectra and 10,000 proofs by default, in batches with different random draws. Ends with 1 if one is wrong.
"""
import collections
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import time

folder = pathlib.Path(sys.argv[1])
trims, spectra, proofs, processes = (
    int(a) for a in (sys.argv[2:] + ["1000000", "100000", "10000", str(os.cpu_count())][len(sys.argv) - 2:]))
# Trials in one batch of each program, for TILTRIM_TRIALS = 1.
PROGRAMS = [("trim_tests", ["--source-file=*/trim_planted_test.cpp"], 3600, 10, trims),
            ("linearize_tests", ["--source-file=*/modes_test.cpp", "-tc=*planted spectrum*"], 2000, 5, spectra),
            ("prove_tests", ["--source-file=*/prove_planted_test.cpp"], 200, 5, proofs),
            # As many matrices by Routh's test against their eigenvalues.
            ("linearize_tests", ["--source-file=*/stability_map_test.cpp", "-tc=*no random matrix*"], 250000, 1, trims)]


def share(seed, program, arguments, scale):
    environment = {**os.environ, "TILTRIM_SEED": str(seed), "TILTRIM_TRIALS": str(scale)}
    done = subprocess.run([folder / program, *arguments], env=environment, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


work = [(program, arguments, scale) for program, arguments, one, scale, wanted in PROGRAMS
        for _ in range(-(-wanted // (one * scale)))]
total = collections.defaultdict(lambda: [0, 0, 0])
failed = 0
start = time.monotonic()
with concurrent.futures.ThreadPoolExecutor(processes) as pool:
    shares = [pool.submit(share, seed, *w) for seed, w in enumerate(work, 1)]
    for count, done in enumerate(concurrent.futures.as_completed(shares), 1):
        code, text = done.result()
        if code:
            failed += 1
            print(text, flush=True)
        for kind, *numbers in re.findall(r"^planted: (.*): (\d+) trials, (\d+) wrong, (\d+) unanswered$", text, re.M):
            total[kind] = [a + int(b) for a, b in zip(total[kind], numbers)]
        if sys.stderr.isatty():
            left = (time.monotonic() - start) / count * (len(shares) - count)
            print(f"\r{count} of {len(shares)} shares, {left:.0f} s left ", end="", file=sys.stderr, flush=True)

print(f"{'planted':34} {'trials':>9} {'wrong':>6} {'unanswered':>11}")
for kind, (trials, wrong, unanswered) in sorted(total.items()):
    print(f"{kind:34} {trials:9} {wrong:6} {unanswered:11}")
wrong = sum(numbers[1] for numbers in total.values())
print(f"{sum(n[0] for n in total.values())} in all, {wrong} wrong, in {time.monotonic() - start:.0f} s")
sys.exit(bool(failed or wrong))
