"""follow: a branch of trims along a parameter, through folds and limits, with its events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _tiltrim
from ._arguments import listed_names, real
from ._linear import Modes, _complex, _modes
from ._models import Array, Model, Point, Signal
from ._needs import need
from ._problems import Guess, Problem, TrimFields, TrimSpec, shows_fields, spec_of
from ._show import Page, Plotted, Shown, Table, number
from ._studies import Condition, _model_of, of_studies
from ._trim import TrimResult, asked, time_limited, trim

if TYPE_CHECKING:
    import xarray
    from typing_extensions import Unpack


@dataclass(repr=False)
class BranchEvent(Shown):
    """An event on a branch."""

    kind: str  #: fold, limit, limit_left, zero, hopf, branch_point, end
    parameter: float  #: its location, in the branch's unit
    error: float  #: error bound of the location; inf: not determined
    point: Point
    outputs: Array  #: shape (ny,)
    which: str  #: the limit, the mode, or the reason for the end
    after: int  #: number of points of the branch before it
    unstable: Optional[int]  #: number of eigenvalues with positive real part
    eigenvalue: Optional[complex]  #: on the imaginary axis, 1/s
    modes: Optional[Modes]

    def _page(self) -> Page:
        where = "" if self.eigenvalue is None else f", {_complex(self.eigenvalue)} 1/s"
        return Page(f"{self.kind} at {number(self.parameter)}{where}: {self.which}")


@dataclass(repr=False)
class Branch(Plotted):
    """Verified trims along a parameter: branch["gap"] is any variable or output over the points.

    parameter : the continuation parameter; values are its values, shape (points,)
    x, u, p   : shapes (points, nx), (points, nu), (points, np);  outputs: (points, ny)
    unstable  : eigenvalues with positive real part, shape (points,); -1: see no_stability
    least     : whether the trim minimizes the effort, if there is one
    """

    end: str  #: reached, limit, closed, switched, not_implied, stuck, not_finite, singular, points,
    #: no_start, interrupted
    message: str  #: the reason for the end
    model: Model
    parameter: Signal
    values: Array
    x: Array
    u: Array
    p: Array
    outputs: Array
    residual: Array
    unstable: NDArray[np.int32]
    least: NDArray[np.bool_]
    events: List[BranchEvent]  #: along the branch; the last is the end
    no_stability: str  #: why eigenvalues were not computed; else empty
    evaluations: int
    exception: Optional[BaseException] = None

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, name: str) -> Array:
        for signals, values in self._columns():
            for i, signal in enumerate(signals):
                if signal.name == name:
                    return np.array(values[:, i])
        _tiltrim.variable(self.model._core, name)  # raises, with the names there are
        raise KeyError(name)

    def _columns(self) -> List[Tuple[Tuple[Signal, ...], Array]]:
        m = self.model
        return [
            (m.states, self.x),
            (m.inputs, self.u),
            (m.parameters, self.p),
            (m.outputs, self.outputs),
        ]

    def point(self, number: int) -> Point:
        """A point of the branch; 0 is the start."""
        return Point(self.model, self.x[number], self.u[number], self.p[number])

    def to_dataframe(self) -> Any:
        """A pandas.DataFrame over the points, one column per signal; needs pandas."""
        pd = need("pandas", "pandas", "to_dataframe()")
        columns: Dict[str, Any] = {self.parameter.name: self.values}
        for signals, values in self._columns():
            columns.update({s.name: values[:, i] for i, s in enumerate(signals)})
        columns["unstable"] = self.unstable
        return pd.DataFrame(columns)

    def to_xarray(self) -> xarray.Dataset:
        """A Dataset over `point`, with events over `event`; needs xarray."""
        xr = need("xarray", "xarray", "to_xarray()")
        m = self.model
        data: Dict[str, Any] = {
            "unstable": ("point", self.unstable),
            "residual": ("point", self.residual, {"units": "1/s"}),
            "least": ("point", self.least),
            "event_kind": ("event", [e.kind for e in self.events]),
            "event_at": ("event", [e.parameter for e in self.events]),
            "event_after": ("event", [e.after for e in self.events]),
            "event_which": ("event", [e.which for e in self.events]),
            "event_state": (
                ("event", "state"),
                _rows([e.point.x for e in self.events], len(m.states)),
            ),
        }
        coords: Dict[str, Any] = {
            self.parameter.name: ("point", self.values, {"units": self.parameter.unit})
        }
        for name, signals, values in (
            ("state", m.states, self.x),
            ("input", m.inputs, self.u),
            ("output", m.outputs, self.outputs),
        ):
            coords[name] = np.array([s.name for s in signals], dtype=str)
            coords[f"{name}_unit"] = (name, np.array([s.unit for s in signals], dtype=str))
            data[f"{name}_value"] = (("point", name), values)
        attributes = {"model": m.name, "end": self.end, "message": self.message}
        return xr.Dataset(data, coords, attributes)  # type: ignore[no-any-return]

    def _page(self) -> Page:
        unit = f" {self.parameter.unit}" if self.parameter.unit else ""
        span = ""
        if len(self):
            span = (
                f"{self.parameter.name} from {number(self.values[0])} to "
                f"{number(self.values[-1])}{unit}, {len(self)} points"
            )
        states = self.model.states
        rows = [
            [
                e.kind,
                number(e.parameter, 8),
                *(number(v) for v in e.point.x),
                "" if e.unstable is None else str(e.unstable),
                e.which,
            ]
            for e in self.events
        ]
        headings = ["event", self.parameter.name, *(s.name for s in states), "unstable", "which"]
        units = ["", self.parameter.unit, *(s.unit for s in states), "", ""]
        table = Table(headings, rows, units, left=(0, len(headings) - 1))
        heading = f"{self.end}: {self.model.name}"
        return Page(heading, [span, self.message], [table])


def _rows(rows: Sequence[Array], columns: int) -> Array:
    return np.array(rows, dtype=float).reshape(len(rows), columns)


@of_studies
@shows_fields
def follow(
    what: Union[Model, Problem, Condition, TrimResult],
    start: Optional[Guess] = None,
    parameter: str = "",
    to: Optional[float] = None,
    *,
    spec: Optional[TrimSpec] = None,
    max_step: float = 0.5,
    max_points: int = 5000,
    stability: bool = True,
    tolerance: float = 1e-10,
    step_tolerance: float = 1e-9,
    time_limit: Optional[float] = None,
    **fields: Unpack[TrimFields],
) -> Branch:
    """Follows trims along a parameter, from the one at `start` to parameter = `to`.

    what      : a Model, with a start (values by name, or a Point) and what is asked; a TrimResult,
                which has all three; a Problem, trimmed first; a Condition; or a Study or its
                path: {name: branch}, or the one of condition=
    parameter : a variable that the trim does not move; of a Condition a number of its study, as
                "V", "eta_deg", "gains.K_Lp", in the study's unit (default: what its [follow] says)
    max_step  : length of a step, every unknown over its nominal size; max_points of them at most
    stability : eigenvalues along the branch, real and Hopf crossings
    tolerance, step_tolerance : as of trim()
    time_limit : of the trim of a Problem or a Condition, s of wall clock

    Raises ValueError for unknown names. A branch without a start has no points.
    """
    own = spec_of("follow", spec, fields)
    options = {
        "max_step": max_step,
        "max_points": max_points,
        "stability": stability,
        "tolerance": tolerance,
        "step_tolerance": step_tolerance,
    }
    if isinstance(what, Condition):
        return _follow_condition(what, parameter, to, options, time_limited(time_limit))
    if not parameter or to is None:
        raise TypeError("follow() needs a parameter and where it is to go: parameter=, to=")
    (parameter,), to = listed_names("parameter", [parameter]), real("to", to)
    if isinstance(what, Problem) and start is None:
        what = trim(what, time_limit=time_limit)
    if isinstance(what, TrimResult):
        own = own if own._asked() else what.spec
        start = what.point if start is None else start
        what = what.model
    model, own, at = asked(what, start, own, "follow")
    raw = _tiltrim.follow(model._core, own._fields(), at._tuple(), parameter, to, options)
    return _branch(raw, model, _signal(model, parameter))


def _follow_condition(
    condition: Condition,
    parameter: str,
    to: Optional[float],
    options: Dict[str, Any],
    trimming: Dict[str, float],
) -> Branch:
    table = condition.study._core.follow
    if not parameter and to is None and table is not None:
        parameter, to = table
    if not parameter or to is None:
        raise TypeError("follow() needs a parameter and where it is to go: parameter=, to=")
    raw = _tiltrim.follow_condition(condition._core, parameter, to, options, trimming)
    model = Model._of(raw["model"], (_model_of, (condition,)))
    return _branch(raw, model, Signal(*raw["parameter"]))


def _signal(model: Model, name: str) -> Signal:
    return (*model.states, *model.inputs, *model.parameters)[_tiltrim.variable(model._core, name)]


def _branch(raw: Dict[str, Any], model: Model, parameter: Signal) -> Branch:
    names = [s.name for s in model.states]
    for event in raw["events"]:
        event["point"] = Point(model, *event["point"])
        if event["modes"] is not None:
            event["modes"] = _modes(event["modes"], names)
    events = [BranchEvent(**event) for event in raw["events"]]
    points = raw["points"]
    return Branch(
        end=raw["end"],
        message=raw["message"],
        model=model,
        parameter=parameter,
        values=points["parameter"],
        x=points["x"],
        u=points["u"],
        p=points["p"],
        outputs=points["outputs"],
        residual=points["residual"],
        unstable=points["unstable"],
        least=np.array(points["least"], dtype=bool),
        events=events,
        no_stability=raw["no_stability"],
        evaluations=raw["evaluations"],
        exception=raw["exception"],
    )
