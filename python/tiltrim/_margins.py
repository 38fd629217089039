"""margins: stability margins of loops, broken one at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _tiltrim
from ._linear import LinearModel, Modes, _modes, _place, linearize, modes
from ._models import Array
from ._problems import Problem
from ._show import Page, Plotted, Table, number
from ._studies import Condition, of_studies
from ._trim import TrimResult, time_limited

#: loops by name, each from an input of the linear model to one of its outputs or states
Loops = Mapping[str, Tuple[str, str]]


@dataclass(repr=False)
class LoopMargins(Plotted):
    """Margins of one loop L(s) = c (sI - A)⁻¹ b + d, all others closed; 1 + L = 0 gives the
    eigenvalues of the closed loop. Frequencies `..._at` in rad/s, inf if there is none.

    True if the closed loop is stable and no crossing was missed.
    """

    name: str
    in_use: bool  #: False: the law does not command it here, or it moves nothing; no margins
    verdict: str  #: of the closed loop: stable, unstable, undecided; margins only if stable
    gain_up: float  #: smallest destabilizing factor above 1
    gain_up_at: float
    gain_down: float  #: largest destabilizing factor below 1; 0: none
    gain_down_at: float
    phase: float  #: smallest destabilizing lag or lead, rad
    phase_at: float
    delay: float  #: smallest destabilizing delay, s
    delay_at: float
    disk: float  #: symmetric disk margin
    disk_at: float
    disk_gain_up: float  #: guaranteed by the disk margin, as the two below
    disk_gain_down: float
    disk_phase: float  #: rad
    sensitivity_peak: float  #: max |1/(1 + L)|
    sensitivity_peak_at: float
    phase_crossings: List[Tuple[float, float]]  #: (rad/s, factor) with L < 0
    gain_crossovers: List[Tuple[float, float]]  #: (rad/s, lag [rad]) with |L| = 1
    residual: float  #: largest |1 + change L| over these
    complete: bool  #: no crossing was missed
    A: Array
    b: Array
    c: Array
    d: float
    frequency: Array  #: of the Bode data, rad/s
    magnitude: Array  #: |L|
    phase_of: Array  #: of L, rad, without jumps

    def __bool__(self) -> bool:
        return self.in_use and self.verdict == "stable" and self.complete

    def _row(self) -> List[str]:
        if not self.in_use or self.verdict != "stable":
            word = self.verdict if self.in_use else "not in use"
            return [self.name, *[""] * 5, word]
        return [
            self.name,
            f"{_decibels(self.gain_up):.2f}",
            f"{_decibels(self.gain_down):.2f}",
            f"{math.degrees(self.phase):.2f}",
            number(self.delay, 4),
            f"{self.disk:.3f}",
            self.verdict if self.complete else "incomplete",
        ]

    def _page(self) -> Page:
        return Page(f"loop {self.name}: {self._row()[-1]}", [], [_table([self])])


def _decibels(factor: float) -> float:
    return 20 * math.log10(factor) if factor > 0 else -math.inf


def _table(loops: Sequence[LoopMargins]) -> Table:
    headings = ["loop", "gain up", "down", "phase", "delay", "disk", "closed loop"]
    units = ["", "dB", "dB", "°", "s", "", ""]
    return Table(headings, [one._row() for one in loops], units, left=(0, 6))


@dataclass(repr=False)
class Margins(Plotted):
    """Margins of each loop: margins["theta0"].phase. True if every loop in use has its margins."""

    status: str  #: of the trim, or of the linear model
    message: str  #: why there are none
    modes: Optional[Modes]  #: of the closed loop
    loops: Dict[str, LoopMargins] = field(default_factory=dict)
    answered: bool = True  #: a trim without remark, a decided verdict, all margins found

    @property
    def verdict(self) -> str:
        """Of the closed loop; empty without a linear model."""
        return "" if self.modes is None else self.modes.verdict

    def __getitem__(self, name: str) -> LoopMargins:
        if name not in self.loops:
            known = ", ".join(self.loops)
            raise _tiltrim.InvalidArgument(f"no loop '{name}'; there are: {known}")
        return self.loops[name]

    def __bool__(self) -> bool:
        return self.verdict == "stable" and all(o for o in self.loops.values() if o.in_use)

    def _page(self) -> Page:
        heading = f"{self.status}: {self.verdict or 'no linear model'}"
        return Page(heading, [self.message], [_table(list(self.loops.values()))])


@of_studies
def margins(
    what: Union[LinearModel, TrimResult, Problem, Condition],
    loops: Union[Loops, Sequence[str]] = (),
    *,
    closed: bool = True,
    frequency: Tuple[Optional[float], Optional[float]] = (None, None),
    points: int = 200,
    time_limit: Optional[float] = None,
) -> Margins:
    """Gain, phase, delay and disk margins of loops, each broken at one place, the others closed.

    what   : a Condition of the closed loop: its loops broken at the actuators, or at the
             [[model.loop]] of its study; a LinearModel, or a TrimResult or Problem, linearized
             first; or a Study or its path: {name: margins}, or those of condition=
    loops  : of a Condition, names; default: all. Else {name: (input, output)}: what is added to
             `input` comes back in `output`, the loop's command before the addition
    closed : False: the linear model is the open loop, which input = -output would close
    frequency : lowest and highest of the Bode data, rad/s; default: a decade beyond the
             eigenvalues; `points` of them
    time_limit : as of linearize()

    Raises ValueError for unknown names and conditions without loops (docs/linearize.md).
    """
    if isinstance(what, Condition):
        raw = _tiltrim.margins_condition(
            what._core, list(loops), *frequency, points, time_limited(time_limit)
        )
        found = None if raw["modes"] is None else _modes(raw["modes"], raw["states"])
        of_loops = {one["name"]: LoopMargins(**one) for one in raw["loops"]}
        return Margins(raw["status"], raw["message"], found, of_loops, raw["answered"])
    if not isinstance(loops, Mapping) or not loops:
        raise TypeError(f"margins() of a {type(what).__name__} needs loops={{name: (input, output)}}")
    linear = what if isinstance(what, LinearModel) else linearize(what, time_limit=time_limit)
    if not linear:
        return Margins(linear.status, linear.message, None, answered=False)
    names = [s.name for s in linear.states]
    answers, spectra = [], []
    for name, ends in loops.items():
        one = _loop(linear, name, *ends, closed, frequency, points)
        spectra.append(modes(linear) if closed else modes(*_closed(linear, one, *ends), names))
        if one.verdict == "stable" and spectra[-1].verdict != "stable":  # within the errors of A
            one = replace(one, verdict=spectra[-1].verdict)
        answers.append(one)
    return Margins(linear.status, "", spectra[0], {one.name: one for one in answers}, all(answers))


def _loop(
    linear: LinearModel,
    name: str,
    input: str,
    output: str,
    closed: bool,
    frequency: Tuple[Optional[float], Optional[float]],
    points: int,
) -> LoopMargins:
    rows = np.vstack([linear.C, np.eye(len(linear.states))])
    through = np.vstack([linear.D, np.zeros((len(linear.states), len(linear.inputs)))])
    i = _place(output, [s.name for s in (*linear.outputs, *linear.states)], "output")
    j = _place(input, [s.name for s in linear.inputs], "input")
    sizes = np.abs(np.linalg.eigvals(linear.A))
    sizes = sizes[sizes > 1e-6]
    lowest = frequency[0] or (sizes.min() / 10 if sizes.size else 0.01)
    highest = frequency[1] or (sizes.max() * 10 if sizes.size else 100.0)
    raw = _tiltrim.margins(
        name, linear.A, linear.B[:, j], rows[i], through[i, j], closed, lowest, highest, points
    )
    return LoopMargins(**raw)


def _closed(linear: LinearModel, loop: LoopMargins, input: str, output: str) -> Tuple[Array, Array]:
    """A of the closed loop, A - b c/(1 + d), and the error of each entry."""
    i = _place(output, [s.name for s in (*linear.outputs, *linear.states)], "output")
    j = _place(input, [s.name for s in linear.inputs], "input")
    is_state = i >= len(linear.outputs)
    c_error = 0 * loop.c if is_state else linear.C_error[i]
    d_error = 0.0 if is_state else linear.D_error[i, j]
    b, b_error, c = np.abs(loop.b), linear.B_error[:, j], np.abs(loop.c)
    least = abs(1 + loop.d) - d_error
    A = np.asarray(loop.A - np.outer(loop.b, loop.c) / (1 + loop.d))
    if least <= 0:
        return A, np.full_like(A, np.inf)
    products = np.outer(b_error, c + c_error) + np.outer(b, c_error)
    return A, linear.A_error + (products + np.outer(b, c) * d_error / abs(1 + loop.d)) / least
