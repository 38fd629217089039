"""tune: gains with the best worst case over operating points."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from . import _tiltrim
from ._arguments import MOST_THREADS, listed_names, mapping, pair, real, whole
from ._models import Array, Model
from ._problems import Guess, Problem, TrimFields, TrimSpec, shows_fields, spec_of
from ._progress import Progress, told
from ._show import Page, Shown, Table, number
from ._studies import Condition, Study, StudyLike, read_study
from ._trim import TrimResult, time_limited
from ._sweep import Problems, _problem

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: {measure: limit}, or [(measure, limit, of)], or [{"measure": ..., "at_most": ...}]
Limits = Union[Mapping[str, float], Sequence[Union[Tuple[Any, ...], Mapping[str, Any]]]]
#: "decay", ("half_time", mode), {"measure": ...}, or a list of these dicts with targets
Goal = Union[str, Tuple[str, str], Mapping[str, Any], List[Mapping[str, Any]]]


@dataclass(repr=False)
class Achieved(Shown):
    """One requirement at one place, evaluated again at the optimum."""

    point: str
    scatter: str  #: "mass +15 %"; empty: nominal
    measure: str
    unit: str
    of: str
    limit: float  #: NaN for the goal
    goal: bool
    value: float
    eigenvalue: complex  #: the one that decides; NaN if none does
    active: bool  #: active at the optimum
    reserve: float  #: margin to the limit, over its size

    def _page(self) -> Page:
        limit = "" if self.goal else f", limit {number(self.limit)}"
        return Page(f"{self.measure} {number(self.value)} {self.unit} at {self.point}{limit}")


@dataclass(repr=False)
class GainEffect(Shown):
    """The effect of one tuned parameter at the optimum."""

    name: str
    value: float
    slopes: Array  #: d(worst value)/d(ln gain), for the goal and each limit
    goal_less: float  #: worst value of the goal with the gain reduced by 10 %, trimmed again
    goal_more: float
    limits_less: bool  #: all limits are met there
    limits_more: bool

    def _page(self) -> Page:
        return Page(
            f"{self.name} = {number(self.value)}: goal {number(self.goal_less)} with 10 % less, "
            f"{number(self.goal_more)} with 10 % more"
        )


@dataclass(repr=False)
class Robustness(Shown):
    """Random samples of the uncertain parameters between their bounds, with the tuned gains."""

    samples: int
    met: int  #: trimmed and stable at all points, all limits met
    no_trim: int
    unstable: int
    fraction: float  #: met / samples
    lower: float  #: Clopper-Pearson, 95 %
    upper: float
    worst_goal: float  #: over the samples with a trim; or NaN
    worst: str  #: its point and parameters
    interrupted: bool  #: fewer samples than the study asks for

    def _page(self) -> Page:
        return Page(
            f"{self.met} of {self.samples} random samples meet all limits, 95 % interval "
            f"{100 * self.lower:.2f} to {100 * self.upper:.2f} %"
        )


@dataclass(repr=False)
class FrontPoint(Shown):
    """The optimum for one value of the limit that a front varies."""

    limit: float
    result: TuneResult

    def _page(self) -> Page:
        return Page(f"limit {number(self.limit)}: {self.result._page().heading}")


@dataclass(repr=False)
class TuneResult(Shown):
    """Tuned gains by name, in SI units; true if all limits are verified to be met."""

    status: str  #: tuned, limits_unmet, unstable, no_trim
    message: str
    names: List[str]
    numbers: Array  #: shape (gains,), or (gains, tilts of the schedule)
    schedule: Tuple[float, ...]
    goal: float  #: worst value of the goal over all places
    goal_measure: str
    goal_unit: str
    achieved: List[Achieved]
    effects: List[GainEffect]  #: largest first
    coalescing: bool  #: two decisive eigenvalues coalesce at the optimum
    end: str  #: locally_optimal, stagnated, budget_spent, no_influence
    stationarity: float  #: least norm in the hull of nearby gradients, over the largest; or NaN
    starts: int  #: local searches completed
    agreeing: int  #: of these, within 0.1 % of the best
    evaluations: int
    interrupted: bool  #: progress returned False
    out_of_time: bool
    out_of_evaluations: bool
    exception: Optional[BaseException] = None
    algorithm: str = ""  #: of a study: the one that found this
    second_algorithm: str = ""  #: of the search for comparison, and its optimum
    second: Optional[TuneResult] = None
    robustness: Optional[Robustness] = None  #: of a study with [[tune.uncertain]]
    front: List[FrontPoint] = field(default_factory=list)  #: of a study with [tune.front]
    front_limit: Tuple[str, ...] = ()  #: the limit it varies: measure, and of what
    toml: str = ""  #: of a study: the gains, to paste

    @property
    def gains(self) -> Dict[str, Any]:
        """{name: value}; with a schedule, arrays over its values."""
        if not len(self.numbers):
            return {}
        return {
            name: self.numbers[i] if self.schedule else float(self.numbers[i])
            for i, name in enumerate(self.names)
        }

    def __getitem__(self, name: str) -> Any:
        return self.gains[name]

    def __bool__(self) -> bool:
        return self.status == "tuned"

    def _page(self) -> Page:
        rows = [
            [name, ", ".join(number(float(v)) for v in (value if self.schedule else [value]))]
            for name, value in self.gains.items()
        ]
        held = [a for a in self.achieved if a.active]
        unit = f" {self.goal_unit}" if self.goal_unit else ""
        lines = [
            self.message,
            f"worst {self.goal_measure} {number(self.goal)}{unit}, {self.evaluations} candidates",
            "held by " + "; ".join(f"{a.measure} at {a.point}" for a in held[:3]) if held else "",
            repr(self.robustness) if self.robustness else "",
        ]
        tables = [Table(["gain", "value"], rows, left=(0,))]
        if self.front:
            front = [[number(p.limit), number(p.result.goal), p.result.status] for p in self.front]
            tables.append(Table([self.front_limit[0], self.goal_measure, "status"], front))
        return Page(self.status, lines, tables)


@shows_fields
def tune(
    what: Union[Model, Problem, Condition, TrimResult, StudyLike, Problems],
    guess: Optional[Guess] = None,
    *,
    gains: Optional[Mapping[str, Tuple[float, float]]] = None,
    goal: Goal = "decay",
    limits: Limits = (),
    disturbance: Optional[Mapping[str, float]] = None,
    uncertain: Optional[Mapping[str, Tuple[float, float]]] = None,
    corners: bool = True,
    samples: int = 0,
    schedule: Sequence[float] = (),
    schedule_over: str = "eta",
    linear: Sequence[str] = (),
    spec: Optional[TrimSpec] = None,
    start: Optional[Sequence[float]] = None,
    starts: Optional[Sequence[Sequence[float]]] = None,
    regulator_starts: Optional[Sequence[float]] = None,
    placed_starts: Optional[Sequence[float]] = None,
    evaluations: Optional[int] = None,
    seconds: Optional[float] = None,
    seed: Optional[int] = None,
    threads: Optional[int] = None,
    global_search: Optional[str] = None,
    local_search: Optional[str] = None,
    time_limit: Optional[float] = None,
    progress: Progress = None,
    **fields: Unpack[TrimFields],
) -> TuneResult:
    """Optimizes gains for the worst of all operating points; every candidate is trimmed again.

    what     : a Model with a guess and a trim specification; a Problem or a Condition; a list of
               those; or a Study or its path, with its own [tune], which only the last options
               override: its two searches, of which the better optimum is returned, then random
               samples and front
    gains    : {parameter: (from, to)}, SI; searched logarithmically if both are positive, except
               those named in `linear`
    goal     : optimized for its worst value: "decay" (1/s), "damping", "frequency" (rad/s), ...;
               ("half_time", name of the mode); or {"measure": ..., "input": ..., "output": ...} and
               the other keys of a measure in a study; or a list of these, each with its target as
               "at_most" or "at_least": the smallest reserve is maximized
    limits   : {measure: limit}, or [(measure, limit, of)], or such dicts with "at_most" or
               "at_least" (docs/tune.md has the measures)
    disturbance : {state: offset} of quadratic_cost and response_use
    uncertain: {parameter: (from, to)}: each point again at all of their corners (unless corners is
               False) and at `samples` random places between
    schedule : gains linear between their values at these, rising, of the parameter schedule_over
    start    : numbers tried first; starts: further ones, a sequence each
    regulator_starts, placed_starts : further starts, nearest to linear-quadratic regulators with
               these efforts, to state feedback with poles of these decays (1/s); of conditions of
               the tiltrotor and of studies whose loops can be opened
    evaluations, seconds, seed, threads, global_search, local_search : budget and algorithms,
               defaults as of the library or the study
    time_limit : of each trim from nothing, s of wall clock
    progress : True, or progress(done, total, text): returning False stops with the best so far

    Raises ValueError for unknown names, reversed bounds, no free parameter.
    """
    own = spec_of("tune", spec, fields)
    options: Dict[str, Any] = {
        name: value
        for name, value in (
            ("start", start),
            ("starts", starts),
            ("regulator_starts", regulator_starts),
            ("placed_starts", placed_starts),
            ("seconds", None if seconds is None else _seconds(seconds)),
            ("global_search", global_search),
            ("local_search", local_search),
        )
        if value is not None
    }
    options.update(time_limited(time_limit))
    for name, count, most in (
        ("evaluations", evaluations, 10**9),
        ("seed", seed, 2**53),
        ("threads", threads, MOST_THREADS),
    ):
        if count is not None:
            options[name] = whole(name, count, most)
    if isinstance(what, (str, os.PathLike)):
        what = read_study(what)
    if isinstance(what, Study):
        if gains or limits:
            raise TypeError("tune() of a study: gains and limits are those of its [tune]")
        with told(progress) as tell:
            return _result(_tiltrim.tune_study(what._core, options, tell))
    members = [what] if isinstance(what, (Model, Problem, Condition, TrimResult)) else list(what)
    asked: Any = goal
    goals = asked if isinstance(asked, list) else [asked]
    ranges = "{parameter: (from, to)}"
    plainly = listed_names("linear", linear)
    for name in plainly:
        if name not in (gains or {}):
            raise _tiltrim.InvalidArgument(
                f"linear: '{name}' is no gain; there are: {', '.join(map(str, gains or {}))}"
            )
    request = {
        "gains": [
            _gain(name, bound, plainly) for name, bound in mapping("gains", gains, ranges).items()
        ],
        "uncertain": [
            (name, *pair(f"uncertain: {name}", bound))
            for name, bound in mapping("uncertain", uncertain, ranges).items()
        ],
        "corners": corners,
        "samples": whole("samples", samples, 10**6),
        "schedule": [_finite("schedule", v) for v in schedule],
        "schedule_over": schedule_over,
        "disturbance": {
            name: _finite(f"disturbance: {name}", value)
            for name, value in mapping("disturbance", disturbance, "{state: offset}").items()
        },
        "goals": [_goal(one) for one in goals],
        "limits": [
            _requirement(one) for one in (limits.items() if isinstance(limits, Mapping) else limits)
        ],
    }
    conditions = [one for one in members if isinstance(one, Condition)]
    with told(progress) as tell:
        if conditions and len(conditions) == len(members):
            cores = [c._core for c in conditions]
            return _result(_tiltrim.tune_conditions(cores, request, options, tell))
        problems = [_problem(one, guess, own, (), "tune") for one in members]
        return _result(_tiltrim.tune(problems, request, options, tell))


def _finite(what: str, given: Any) -> float:
    number = real(what, given)
    if not math.isfinite(number):
        raise _tiltrim.InvalidArgument(f"{what}: expected a finite number, got {number:g}")
    return number


def _seconds(given: Any) -> float:
    seconds = real("seconds", given)
    if not seconds >= 0:
        raise _tiltrim.InvalidArgument(f"seconds: expected 0 or more, got {seconds:g}")
    return seconds


def _gain(
    name: str, bound: Tuple[float, float], linear: Sequence[str]
) -> Tuple[str, float, float, bool]:
    lower, upper = pair(f"gains: {name}", bound)
    return name, lower, upper, lower > 0 and name not in linear


def _goal(given: Any) -> Dict[str, Any]:
    if isinstance(given, str):
        return {"measure": given, "limit": math.nan}
    if isinstance(given, Mapping):
        return _keys(given)
    if not isinstance(given, Sequence) or len(given) != 2:
        raise TypeError(f"goal: expected a measure, (measure, of) or a dictionary, got {given!r}")
    return {"measure": given[0], "of": given[1], "limit": math.nan}


def _requirement(given: Union[Tuple[Any, ...], Mapping[str, Any]]) -> Dict[str, Any]:
    if isinstance(given, Mapping):
        return _keys(given)
    if isinstance(given, (str, bytes)) or not isinstance(given, Sequence) or len(given) < 2:
        raise TypeError(f"limits: expected (measure, limit) or a dictionary, got {given!r}")
    measure, limit, *of = given
    return {"measure": str(measure), "limit": real(str(measure), limit), "of": str(of[0]) if of else ""}


_SIDES = ("at_least", "at_most", "limit")


def _keys(given: Mapping[str, Any]) -> Dict[str, Any]:
    """A requirement as a study's table: a name alone is a list of one."""
    own = {name: value for name, value in given.items() if name != "weight"}
    own.update({side: real(side, given[side]) for side in _SIDES if side in given})
    for name in ("input", "output"):
        if name in own:
            own[name] = [own[name]] if isinstance(own[name], str) else list(own[name])
    for name, polynomial in given.get("weight", {}).items():
        own[name] = [float(c) for c in polynomial]
    return own


def _result(raw: Dict[str, Any]) -> TuneResult:
    own = dict(raw)
    places = len(raw["schedule"])
    numbers = own.pop("gains")
    own["numbers"] = numbers.reshape(-1, places) if places else numbers
    own["schedule"] = tuple(raw["schedule"])
    if "second" in raw:
        own["second"] = _result(raw["second"])
    if "robustness" in raw:
        own["robustness"] = Robustness(**raw["robustness"])
    own["front"] = [FrontPoint(limit, _result(one)) for limit, one in raw.get("front", ())]
    own["achieved"] = [Achieved(**one) for one in raw["achieved"]]
    own["effects"] = [GainEffect(**one) for one in raw["effects"]]
    return TuneResult(**own)
