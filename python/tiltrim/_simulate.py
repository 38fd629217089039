"""simulate: the motion of a model, and the flights of a study."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import (
    TYPE_CHECKING,
    Any,
    Callable,
    Dict,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Union,
    overload,
)

import numpy as np
from numpy.typing import ArrayLike

from . import _tiltrim
from ._arguments import real, whole
from ._models import Array, Model, Point
from ._needs import need
from ._problems import Guess
from ._show import Page, Plotted, Table, number
from ._studies import Condition, Study, StudyLike, read_study, study_of
from ._trim import TrimResult

if TYPE_CHECKING:
    import xarray

#: constant inputs by name; or a function of time [s] that returns all inputs, shape (nu,)
Input = Union[Mapping[str, float], Callable[[float], ArrayLike]]


class Change(NamedTuple):
    """`size` is added to an input or parameter from `start` until `end` [s]."""

    signal: str
    size: float
    start: float = 0.0
    end: float = math.inf


class SwitchEvent(NamedTuple):
    """A crossing of one of the model's switches; rising: its function becomes positive."""

    name: str
    t: float
    rising: bool


@dataclass(repr=False)
class Trajectory(Plotted):
    """A motion: trajectory["gap"] is any state, input, parameter or output over the times t [s].

    x, u, p, y : shapes (samples, nx), (samples, nu), (samples, np), (samples, ny)
    True if the end time was reached.
    """

    status: str  #: completed, ended_by_event, diverged, not_finite, step_too_small, step_limit, ...
    message: str  #: where and why the motion ended early
    model: Model
    start: Point
    t: Array
    x: Array
    u: Array
    p: Array
    y: Array
    events: List[SwitchEvent]
    steps: int
    evaluations: int
    #: estimated error of each state at its worst sample, the last included; nan: not estimated
    error: Array
    stiff: bool  #: an implicit method was used
    exception: Optional[BaseException] = None  #: the first raised by the model's functions

    def __bool__(self) -> bool:
        return self.status == "completed"

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, name: str) -> Array:
        m = self.model
        for signals, values in (
            (m.states, self.x),
            (m.inputs, self.u),
            (m.parameters, self.p),
            (m.outputs, self.y),
        ):
            for i, signal in enumerate(signals):
                if signal.name == name:
                    return np.array(values[:, i])
        _tiltrim.variable(m._core, name)  # raises, with the names there are
        raise KeyError(name)

    def to_dataframe(self) -> Any:
        """A pandas.DataFrame over `time` [s], one column per signal; needs pandas."""
        pd = need("pandas", "pandas", "to_dataframe()")
        names = [s.name for s in (*self.model.states, *self.model.inputs, *self.model.outputs)]
        return pd.DataFrame({n: self[n] for n in names}, index=pd.Index(self.t, name="time"))

    def to_xarray(self) -> xarray.Dataset:
        """A Dataset over `time`, one variable per signal; needs xarray."""
        xr = need("xarray", "xarray", "to_xarray()")
        m = self.model
        data: Dict[str, Any] = {}
        for signals, values in ((m.outputs, self.y), (m.inputs, self.u), (m.states, self.x)):
            for i, s in enumerate(signals):
                data[s.name] = ("time", values[:, i], {"units": s.unit})
        time = ("time", self.t, {"units": "s"})
        attributes = {"model": m.name, "status": self.status, "message": self.message}
        return xr.Dataset(data, {"time": time}, attributes)  # type: ignore[no-any-return]

    def _page(self) -> Page:
        m = self.model
        rows = [
            [s.name, number(values[0, i]), number(values[-1, i]), s.unit]
            for signals, values in ((m.states, self.x), (m.inputs, self.u), (m.outputs, self.y))
            for i, s in enumerate(signals)
            if len(values)
        ]
        span = f"{number(float(self.t[0]))} to {number(float(self.t[-1]))} s" if len(self) else ""
        how = f"{span}, {len(self)} samples, {self.steps} steps"
        table = Table(["", "first", "last", "unit"], rows, left=(0, 3))
        return Page(f"{self.status}: {m.name}", [self.message, how], [table])


@dataclass(repr=False)
class Flight(Plotted):
    """A study's flight: flight["theta_deg"] is a column over flight["time"]. Angles in degrees.

    True if it reached the end of its duration or landed. For a study with [model], the motion
    of that model, in its units.
    """

    status: str  #: flown, landed, ground_contact, lost, not_finite, stuck, no_trim; for a [model]
    #: completed, and the statuses of a Trajectory
    message: str
    start: str  #: the initial condition
    events: List[Tuple[str, str, float]]  #: kind, what, time [s]
    columns: Dict[str, Array]
    units: Dict[str, str]
    descriptions: Dict[str, str]
    #: estimated error of each column's last value for a flight, of each state at its worst sample
    #: for the motion of a [model]; nan: not estimated
    error: Dict[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return self.status in ("flown", "landed", "completed")

    def __getitem__(self, name: str) -> Array:
        if name not in self.columns:
            raise _tiltrim.InvalidArgument(
                f"no column '{name}'; the flight has: {', '.join(self.columns)}"
            )
        return self.columns[name]

    def to_dataframe(self) -> Any:
        """A pandas.DataFrame over `time` [s], one column per quantity; needs pandas."""
        pd = need("pandas", "pandas", "to_dataframe()")
        columns = {n: v for n, v in self.columns.items() if n != "time"}
        return pd.DataFrame(columns, index=pd.Index(self.columns.get("time", []), name="time"))

    def to_xarray(self) -> xarray.Dataset:
        """A Dataset over `time`, events over `event`; needs xarray."""
        xr = need("xarray", "xarray", "to_xarray()")

        def described(name: str) -> Tuple[str, Array, Dict[str, str]]:
            about = {"units": self.units[name], "long_name": self.descriptions[name]}
            return "time", self.columns[name], about

        data: Dict[str, Any] = {n: described(n) for n in self.columns if n != "time"}
        for i, name in enumerate(("kind", "what", "time")):
            data[f"event_{name}"] = ("event", [event[i] for event in self.events])
        coords = {"time": described("time")} if self.columns else {}
        attributes = {"status": self.status, "message": self.message, "start": self.start}
        return xr.Dataset(data, coords, attributes)  # type: ignore[no-any-return]

    def _page(self) -> Page:
        rows = [[f"{t:.3f}", kind, what] for kind, what, t in self.events]
        table = Table(["t", "event", ""], rows, ["s", "", ""], left=(1, 2))
        return Page(self.status, [self.message, self.start], [table])


@overload
def simulate(model: StudyLike) -> Flight: ...
@overload
def simulate(
    model: Model,
    start: Union[Guess, TrimResult],
    duration: float,
    input: Optional[Input] = None,
    changes: Sequence[Change] = (),
    *,
    sample: float = 0.1,
    breaks: Sequence[float] = (),
    tolerance: float = 1e-9,
    longest_step: float = 0.5,
    max_steps: int = 2_000_000,
) -> Trajectory: ...
def simulate(
    model: Union[Model, StudyLike],
    start: Union[None, Guess, TrimResult] = None,
    duration: Optional[float] = None,
    input: Optional[Input] = None,
    changes: Sequence[Change] = (),
    *,
    sample: float = 0.1,
    breaks: Sequence[float] = (),
    tolerance: float = 1e-9,
    longest_step: float = 0.5,
    max_steps: int = 2_000_000,
) -> Union[Trajectory, Flight]:
    """Simulates a model from an initial point, with error control; or a Study or its path, as fly().

    start    : initial state, inputs and parameters: values by name, a Point or a trim
    duration : s
    input    : {name: value}, constant; or input(t) -> nu numbers, smooth except at `breaks`
               (default: the inputs of the start, constant)
    changes  : temporary, of inputs and parameters: (signal, size, from, until); not with input(t)
    sample   : s between samples; 0: samples at the steps
    breaks   : increasing times [s] at which the input jumps or has a kink
    tolerance: of a step's error, relative to the larger of the state and its nominal size
    longest_step : s; after max_steps attempted steps the status is step_limit

    If the model raises or returns non-finite numbers, the motion ends early with that status.
    """
    if isinstance(model, (str, os.PathLike)):
        model = read_study(model)
    if isinstance(model, Study):
        if start is not None or duration is not None:
            raise TypeError("simulate() of a study: its start and duration are its own")
        return fly(model)
    if start is None or duration is None:
        raise TypeError("simulate() of a model needs a start and a duration")
    at = model.point(start.point if isinstance(start, TrimResult) else start)
    duration, sample = real("duration", duration), real("sample", sample)
    if sample > 0 and duration / sample > _MOST_SAMPLES:
        raise _tiltrim.InvalidArgument(
            f"sample: {duration:g} s in steps of {sample:g} s are more than {_MOST_SAMPLES} samples"
        )
    if isinstance(input, Mapping):
        for name in input:
            if name not in [s.name for s in model.inputs]:
                known = ", ".join(s.name for s in model.inputs)
                raise _tiltrim.InvalidArgument(f"no input '{name}'; the model has: {known}")
        at = at.replace(input)
    elif input is not None and not callable(input):
        raise TypeError(f"input: expected values by name or a function of the time, got {input!r}")
    options = {
        "tolerance": tolerance,
        "sample": sample,
        "longest_step": longest_step,
        "max_steps": max_steps,
    }
    function = None if isinstance(input, Mapping) else input
    if function is not None and changes:
        raise TypeError("simulate(): changes together with input(t); expected them in it, and breaks")
    times = [real("breaks", t) for t in breaks]
    if not all(map(math.isfinite, times)) or any(b < a for a, b in zip(times, times[1:])):
        raise _tiltrim.InvalidArgument(f"breaks: expected finite, increasing times, got {breaks!r}")
    if times and function is None:
        raise TypeError("simulate(): breaks without input(t): they are times at which it jumps")
    listed = [_change(change) for change in changes]
    for change in listed:
        if 0 < duration <= change.start:
            raise _tiltrim.InvalidArgument(
                f"changes: that of {change.signal} begins at {change.start:g} s, not before the end "
                f"of the motion at {duration:g} s"
            )
    raw = _tiltrim.simulate(
        model._core,
        at._tuple(),
        duration,
        [
            (c.signal, real(c.signal, c.size), real("changes", c.start), real("changes", c.end))
            for c in listed
        ],
        function,
        times,
        options,
    )
    raw["events"] = [SwitchEvent(*event) for event in raw["events"]]
    return Trajectory(model=model, start=at, **raw)


#: as of a study's motion
_MOST_SAMPLES = 2_000_000


def _change(given: Any) -> Change:
    if isinstance(given, str) or not isinstance(given, Sequence) or not 2 <= len(given) <= 4:
        raise TypeError(f"changes: expected (signal, size, from, until), got {given!r}")
    return Change(*given)


def fly(study: Union[StudyLike, Condition], *, number: Optional[int] = None) -> Flight:
    """Simulates a study's [simulate]: a flight with schedule, weather, actuators and the ground,
    or the motion of its [model] (docs/simulate.md). number: that flight of its [montecarlo]."""
    own = study.study if isinstance(study, Condition) else study_of("fly", study)
    raw = _tiltrim.fly_study(
        own._core, None if number is None else whole("number", number, 10**7)
    )
    columns = raw["columns"]
    return Flight(
        status=raw["status"],
        message=raw["message"],
        start=raw["start"],
        events=list(raw["events"]),
        columns={name: values for name, _, _, values in columns},
        units={name: unit for name, unit, _, _ in columns},
        descriptions={name: what for name, _, what, _ in columns},
        error=raw["error"],
    )
