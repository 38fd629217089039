"""trim: find an equilibrium, verify it, and explain why none exists."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

from . import _tiltrim
from ._arguments import real
from ._models import Array, Model, Point, point_table
from ._problems import Guess, Problem, TrimFields, TrimSpec, _range, shows_fields, spec_of
from ._show import Page, Shown, number
from ._studies import Condition, _model_of, of_studies

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(repr=False)
class TrimResult(Shown):
    """How a trim ended, with the best point found whatever the status.

    True if the status is "converged": a verified equilibrium within all bounds. Variables and
    outputs are read by name: result["gap"].
    """

    status: str  #: converged, singular, not_optimal, not_implied, infeasible, not_found,
    #: not_finite, model_threw, not_repeatable, interrupted, time_limit (docs/trim.md)
    equilibrium: bool  #: equations and bounds are verified, with or without a remark
    model: Model
    spec: TrimSpec
    point: Point
    rates: Array  #: all state rates at the point, shape (nx,)
    outputs: Array  #: shape (ny,)
    residual: float  #: largest error of a held rate over its nominal size, 1/s
    step: float  #: last Newton step, largest component over nominal size
    rcond: float  #: reciprocal condition number of the scaled equations
    effort: float  #: value of the cost
    limits_active: List[str]  #: "current upper", ...
    others: List[Point]  #: other verified equilibria, by increasing cost
    starts: int
    evaluations: int
    message: str  #: empty when converged without remark
    thrown: str  #: the model's first exception in words; empty: none
    exception: Optional[BaseException] = None  #: the first that the model's functions raised
    #: formulation table: moment coefficients required, and of the elevator
    moment: Optional[Tuple[float, float]] = None
    _linear_inputs: Sequence[str] = ()  # default inputs for linearize()

    def __bool__(self) -> bool:
        return self.status == "converged"

    def _moving(self) -> Sequence[str]:
        if self.spec.steady:
            steady = {*self.spec.steady, *self.spec.implied}
            held = {n for n, rate in self.spec.rates.items() if rate == 0}
            return [s.name for s in self.model.states if s.name not in steady | held]
        return [*self.spec.moving, *(n for n, rate in self.spec.rates.items() if rate != 0)]

    def _problem(self) -> Problem:
        return Problem(self.model, self.point, spec=self.spec)

    def __getitem__(self, name: str) -> float:
        place = self.model._output_place.get(name)
        if place is not None and name not in self.point:
            return float(self.outputs[place]) if len(self.outputs) else math.nan
        return self.point[name]

    def _exceeded(self) -> Dict[str, str]:
        """In words, the limits that the point does not keep."""
        at_limit = {limit.rsplit(" ", 1)[0] for limit in self.limits_active}
        words = {}
        for name, bound in self.spec.bounds.items():
            lower, upper = _range(bound)
            value = math.nan if name in at_limit else self[name]
            if value > upper:
                words[name] = f"{number(value - upper)} above its upper limit {number(upper)}"
            elif value < lower:
                words[name] = f"{number(lower - value)} below its lower limit {number(lower)}"
        return words

    def _page(self) -> Page:
        notes = {name: "free" for name in self.spec.free}
        for limit in self.limits_active:
            signal, side = limit.rsplit(" ", 1)
            notes[signal] = f"at its {side} limit"
        if not self.equilibrium:
            notes.update(self._exceeded())
        outputs = [
            ["output" if i == 0 else "", s.name, number(float(y)), s.unit, notes.get(s.name, "")]
            for i, (s, y) in enumerate(zip(self.model.outputs, self.outputs))
        ]
        table = point_table(self.point, notes)
        table.rows = [*table.rows, *outputs]
        how_sure = f"residual {self.residual:.1g} 1/s, rcond {self.rcond:.2g}"
        if self.others:
            one = len(self.others) == 1
            how_sure += f", {len(self.others)} other equilibri{'um' if one else 'a'}"
        heading = f"{self.status}: {self.model.name}" if self.model.name else self.status
        return Page(heading, [self.message, how_sure], [table])


def time_limited(seconds: Optional[float]) -> Dict[str, float]:
    """The option of a trim, where there is one."""
    if seconds is None:
        return {}
    limit = real("time_limit", seconds)
    if not limit > 0:
        raise _tiltrim.InvalidArgument(f"a time limit of {limit:g} s; expected more than 0 s")
    return {"time_limit": limit}


def asked(
    what: Union[Model, Problem, Condition, TrimResult],
    guess: Optional[Guess],
    spec: TrimSpec,
    verb: str,
) -> Tuple[Model, TrimSpec, Point]:
    """Model, specification and guess from the arguments of a verb."""
    if isinstance(what, Model):
        if guess is None:
            raise TypeError(f"{verb}() of a model needs a guess: values by name, or a Point")
        if not (isinstance(guess, Point) and guess.model is what):
            guess = what.point(guess)
        return what, spec._of(what), guess
    if isinstance(what, TrimResult):
        what = what._problem()
    if not isinstance(what, (Problem, Condition)):
        raise TypeError(
            f"{verb}(): expected a Model, a Problem or a Condition, got {type(what).__name__}"
        )
    if spec._asked() or spec.bounds or spec.implied or spec.effort:
        raise TypeError(f"{verb}() of a {type(what).__name__}: what is free and held is its own")
    return what.model, what.spec, what.guess if guess is None else what.model.point(guess)


def _result(raw: Dict[str, Any], model: Model, spec: TrimSpec) -> TrimResult:
    raw.pop("model", None)
    raw["point"] = Point._holding(model, *raw["point"])
    raw["others"] = [Point._holding(model, *other) for other in raw["others"]]
    raw["limits_active"] = [f"{name} {side}" for name, side, _ in raw["limits_active"]]
    return TrimResult(model=model, spec=spec, **raw)


@of_studies
@shows_fields
def trim(
    what: Union[Model, Problem, Condition, TrimResult],
    guess: Optional[Guess] = None,
    *,
    spec: Optional[TrimSpec] = None,
    method: str = "ipopt",
    tolerance: float = 1e-10,
    step_tolerance: float = 1e-9,
    starts: int = 32,
    others: Optional[bool] = None,
    max_iterations: int = 100,
    max_boxes: int = 20_000,
    closest: bool = True,
    time_limit: Optional[float] = None,
    **fields: Unpack[TrimFields],
) -> TrimResult:
    """Finds an equilibrium of a model from a guess.

    what   : a Model with a guess (values by name, or a Point) and a TrimSpec's arguments; or
             a Problem or a Condition, which have both; or a Study or its path: {name: result},
             or the result of condition=
    method : "ipopt", polished by Newton, then Newton from further starts; "newton" alone needs as
             many unknowns as equations
    tolerance      : on every held rate over its nominal size, 1/s
    step_tolerance : on the last Newton step over nominal sizes
    starts         : further starts over the bounds
    others         : True: every start is tried, and the answer is the equilibrium of least effort,
                     with the others in `others`. False: the first one that is verified, from the
                     guess if it leads to one. Default: False only if no effort is given and an
                     unknown has no bounds, so that there is no region to search; Conditions: True
    max_iterations : of each solver from each start
    max_boxes      : of the proof that there is none, where the model has ranges; 0: no proof
    closest        : where there is no answer, look for the closest point
    time_limit     : s of wall clock; then the status is "time_limit", with the best point so far. A
                     call of the model is not cut short. Default: none, or that of a Condition's
                     study

    Returns a TrimResult, true if it converged. Raises ValueError for unknown names, reversed
    bounds, and more equations than unknowns.
    """
    own = spec_of("trim", spec, fields)
    options = {
        "method": method,
        "tolerance": tolerance,
        "step_tolerance": step_tolerance,
        "starts": starts,
        "max_iterations": max_iterations,
        "max_boxes": max_boxes,
        "closest": closest,
    }
    options.update(time_limited(time_limit))
    if others is not None:
        options["others"] = others
    if isinstance(what, Condition) and guess is None and not own._asked():
        raw = _tiltrim.trim_condition(what._core, options)
        of_table = what.formulation == "table"
        model = Model._of(raw["model"], (_model_of, (what,)))
        result = _result(raw, model, TrimSpec() if of_table else what.spec)
        if what.formulation == "closed_loop":
            result._linear_inputs = ("V", "gamma", "eta")  # the commands of the closed loop
        return result
    model, own, start = asked(what, guess, own, "trim")
    if others is None:
        options["others"] = own._ranks()
    raw = _tiltrim.trim(model._core, own._fields(), start._tuple(), options)
    return _result(raw, model, own)
