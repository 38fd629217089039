"""qualities: levels of flying qualities."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from . import _tiltrim
from ._arguments import real
from ._linear import LinearModel, linearize
from ._problems import Problem
from ._show import Page, Shown, Table, number
from ._studies import Condition, of_studies
from ._trim import TrimResult, time_limited

#: 1, 2, 3, "none", "undecided" or "not judged"
Level = Union[int, str]


@dataclass
class Criterion:
    """A figure judged by one requirement; what is infinite or not known is None."""

    name: str
    requirement: str
    value: Optional[float]
    error: Optional[float]
    unit: str
    level: Level
    distance: Optional[float]  #: to the nearest border, positive inside its better level
    border: str  #: which: "1|2"
    margins: List[Optional[float]]  #: signed distances to the regions of level 1, 2, ...
    margin_error: Optional[float]
    margin_unit: str
    remark: str


@dataclass(repr=False)
class Qualities(Shown):
    """Flying qualities of a linear model: qualities["phugoid damping"].level. True for level 1."""

    status: str  #: judged, no_longitudinal_mode, or of a trim or a linear model that failed
    message: str
    level: Level  #: the worst of all criteria
    criteria: List[Criterion]
    data: Dict[str, Any]  #: everything, as the JSON of `tiltrim qualities` (docs/qualities.md)

    def __getitem__(self, name: str) -> Criterion:
        for one in self.criteria:
            if one.name == name:
                return one
        known = ", ".join(one.name for one in self.criteria)
        raise _tiltrim.InvalidArgument(f"no criterion '{name}'; there are: {known}")

    def __bool__(self) -> bool:
        return self.level == 1

    def _page(self) -> Page:
        def shown(value: Optional[float], digits: int) -> str:
            return "" if value is None else number(value, digits)

        rows = [
            [c.name, shown(c.value, 5), c.unit, str(c.level), shown(c.distance, 3), c.border]
            for c in self.criteria
        ]
        headings = ["criterion", "value", "unit", "level", "distance", "border"]
        lines = [self.message] if self.message else []
        return Page(f"level {self.level}", lines, [Table(headings, rows, left=(0, 2, 5))])


def _qualities(status: str, message: str, data: Optional[Dict[str, Any]]) -> Qualities:
    if data is None:
        return Qualities(status, message, "not judged", [], {})
    criteria = [Criterion(**one) for one in data["criteria"]]
    return Qualities(data["status"], message, data["level"], criteria, data)


def _above_zero(what: str, given: Optional[float]) -> float:
    """The number given; NaN for none, as the core has it."""
    if given is None:
        return math.nan
    if not 0 < real(what, given) < math.inf:
        raise _tiltrim.InvalidArgument(f"{what}: expected a number above 0, got {given!r}")
    return real(what, given)


@of_studies
def qualities(
    what: Union[LinearModel, TrimResult, Problem, Condition],
    roles: Optional[Mapping[str, str]] = None,
    *,
    aircraft: str = "II-L",
    category: str = "B",
    phase: str = "forward",
    response: str = "rate",
    airspeed: Optional[float] = None,
    gravity: Optional[float] = None,
    n_per_alpha: Optional[float] = None,
    bandwidth: Sequence[Sequence[Tuple[float, float]]] = (),
    time_limit: Optional[float] = None,
) -> Qualities:
    """Levels of MIL-F-8785C, MIL-F-83300 and ADS-33E-PRF, with error bounds (docs/qualities.md).

    what     : a Condition, judged by its study's [qualities]; a LinearModel; a TrimResult or
               Problem, linearized first; or a Study or its path: {name: qualities}, or those of
               condition=
    roles    : {role: signal} of anything but a Condition; roles are pitch, pitch_rate, alpha or
               downward_speed, speed, height, normal_acceleration and stick
    aircraft : class: I, II-L, II-C, III, IV
    category : of the flight phase: A, B, C
    phase    : "forward" or "hover", which requirements apply
    response : "rate" or "attitude", what a constant stick commands
    airspeed : true airspeed; default: from the states with the roles of speed
    gravity  : in the units of airspeed and s; default: standard gravity in m/s², or in ft/s² where
               the states with the roles of speed are in ft/s
    n_per_alpha : g/rad, if known; default: computed
    bandwidth : borders of level 1 and 2 in hover: each a sequence of (phase delay [s], least
               bandwidth [rad/s])
    time_limit : as of linearize()

    Raises ValueError for unknown names.
    """
    if isinstance(what, Condition):
        if roles is not None:
            raise TypeError("a Condition takes its roles from the study's [qualities]")
        text = _tiltrim.qualities_condition(what._core, time_limited(time_limit))
        found = json.loads(text)["conditions"][0]
        return _qualities(found["status"], found["message"], found["qualities"])
    if not roles:
        raise TypeError(f"qualities() of a {type(what).__name__} needs roles={{role: signal}}")
    linear = what if isinstance(what, LinearModel) else linearize(what, time_limit=time_limit)
    if not linear:
        return _qualities(linear.status, linear.message, None)
    parts = ("A", "B", "C", "D", "A_error", "B_error", "C_error", "D_error")
    raw: Dict[str, Any] = {name: getattr(linear, name) for name in parts}
    for name in ("states", "inputs", "outputs"):
        raw[name] = [(s.name, s.unit, s.nominal) for s in getattr(linear, name)]
    raw["x"] = linear.point.x
    borders = [[(float(t), float(w)) for t, w in one] for one in bandwidth]
    text = _tiltrim.qualities(
        raw,
        dict(roles),
        (aircraft, category, phase, response),
        _above_zero("airspeed", airspeed),
        _above_zero("gravity", gravity),
        _above_zero("n_per_alpha", n_per_alpha),
        (borders + [[], []])[:2],
    )
    return _qualities("linear", "", json.loads(text))
