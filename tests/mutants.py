#!/usr/bin/env python3
"""Copies of the prover's sources with faults that the environment switches on: TILTRIM_MUTANT=<name>.

    mutants.py <source tree> <folder for the copies>

Every expression must occur exactly once: where the prover changes, its fault must follow.
"""
import pathlib
import sys

source, output = map(pathlib.Path, sys.argv[1:])
# File, expression, the same with a fault; of several lines for one fault, that which the source has.
FAULTS = [
    # Ranges rounded to nearest instead of outward.
    ("model/interval.hpp", "c - (outward * std::abs(c) + smallest)",
     'mutant("nearest") ? c : c - (outward * std::abs(c) + smallest)'),
    ("model/interval.hpp", "c + (outward * std::abs(c) + smallest)",
     'mutant("nearest") ? c : c + (outward * std::abs(c) + smallest)'),
    # The remainder of the linearized loop dropped: what a function linear in the parameters leaves out.
    ("prove/roots.cpp", "= rest * (1 + 1e-12);", '= mutant("no_remainder") ? 0.0 : rest * (1 + 1e-12);',
     "= (entry.rest() +", '= (mutant("no_remainder") ? 0.0 : 1.0) * (entry.rest() +'),
    # The equations' curvature along the tube dropped.
    ("prove/tube.cpp", "const VectorXd H =\n", 'const VectorXd H = (mutant("no_curvature") ? 0.0 : 1.0) *\n',
     "VectorXd rho = magnitudes(g);", 'VectorXd rho = (mutant("no_curvature") ? 0.01 : 1.0) * magnitudes(g);'),
    # Terms of the determinant beyond the second order in the parameters dropped.
    ("prove/determinant.cpp", "return fourth + third + mixed +",
     'return (mutant("no_fourth") ? 0.0 : fourth) + third + (mutant("no_mixed") ? 0.0 : mixed) +'),
    ("prove/determinant.cpp", "third_sum(linear) + cubic;",
     'third_sum(linear) + (mutant("no_third") ? 0.0 : cubic);'),
    ("prove/determinant.cpp", "of(k, b.l, b.m) += trace(k)",
     'of(k, b.l, b.m) += mutant("no_cross") ? Complex(0) : trace(k)'),
    # One side of a switch is enough.
    ("prove/prove.cpp", "if (sides.taken.empty()) return all;",
     'if (mutant("one_side") || sides.taken.empty()) return all;'),
    # The frequencies begin above zero, where a real eigenvalue crosses.
    ("prove/roots.cpp", "  w = {0.0};", '  w = {mutant("zero_skipped") ? end / 64 : 0.0};'),
    # Roots of little damping not counted; the axis searched instead of the ray.
    ("prove/roots.cpp", "count += turned.imag() < 0;", 'count += !mutant("all_damped") && turned.imag() < 0;'),
    ("prove/roots.cpp", "f.along = along;", 'f.along = mutant("no_ray") ? Complex(0, 1) : along;'),
    # The image of the tube may touch its border.
    ("prove/tube.cpp", "K.array() <= 0.9 * r.Z.array()",
     'K.array() <= (mutant("not_strict") ? 1.0 : 0.9) * r.Z.array()'),
    # Upper limits are not examined.
    ("prove/tube.cpp", "at.upper() <= limit.range.upper - slack)",
     '(mutant("no_upper_limit") || at.upper() <= limit.range.upper - slack))'),
]

texts = {}
for file, *choices in FAULTS:
    whole = texts.setdefault(file, (source / file).read_text())
    pairs = list(zip(choices[::2], choices[1::2]))
    text, faulty = next(((t, f) for t, f in pairs if t in whole), pairs[0])
    if whole.count(text) != 1:
        sys.exit(f"{file}: `{text}` occurs {whole.count(text)} times; its fault in {sys.argv[0]} must follow the source")
    texts[file] = whole.replace(text, faulty)
for file, text in texts.items():
    copy = output / file
    copy.parent.mkdir(parents=True, exist_ok=True)
    copy.write_text(f'#include "tests/mutant.hpp"\n{text}')
