"""envelope: where in a plane of two parameters trims exist within the limits, and what ends them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _tiltrim
from ._arguments import pair, real, whole
from ._follow import _signal
from ._models import Array, Model, Point, Signal
from ._needs import need
from ._problems import Guess, Problem, TrimFields, TrimSpec, shows_fields, spec_of
from ._progress import Progress, told
from ._show import Page, Plotted, Shown, Table, number
from ._studies import Condition, of_studies
from ._trim import TrimResult, asked

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(repr=False)
class EnvelopePiece(Shown):
    """A piece of the boundary with one cause: piece["theta"] is any variable or output along it."""

    name: str  #: "delta_e lower", or "fold"
    begins: str  #: another piece's name, "edge", "loop", or a reason; as `ends`
    ends: str
    along: Array  #: coordinates, shape (points,)
    over: Array
    outer: NDArray[np.bool_]  #: no other trim exists on the outer side
    residual: Array
    points: List[Point]
    outputs: Array  #: shape (points, ny)

    def __len__(self) -> int:
        return len(self.along)

    def __getitem__(self, name: str) -> Array:
        if not self.points:
            return np.array([])
        place = self.points[0].model._output_place.get(name)
        if place is not None and name not in self.points[0]:
            return np.array(self.outputs[:, place])
        return np.array([point[name] for point in self.points])

    def _page(self) -> Page:
        return Page(f"{self.name}: {len(self)} points, from {self.begins} to {self.ends}")


@dataclass
class EnvelopePart:
    """A part of the plane, which is one unless the model changes within it."""

    status: str  #: complete, empty, interrupted, incomplete
    along: Tuple[float, float]
    over: Tuple[float, float]
    count: NDArray[np.int32]  #: distinct trims at each grid point, shape (along, over)
    pieces: List[EnvelopePiece]
    #: (over, [(from, what ends it, to, what ends it)]): intervals in which trims exist throughout
    rows: List[Tuple[float, List[Tuple[float, str, float, str]]]]
    evaluations: int


@dataclass(repr=False)
class Envelope(Plotted):
    """Where trims exist within the limits, over the plane of `along` and `over`, in their units.

    True if a trim was found and the search was completed.
    """

    model: Model
    along: Signal
    over: Signal
    parts: List[EnvelopePart]
    exception: Optional[BaseException] = None

    @property
    def status(self) -> str:
        """interrupted; incomplete: the boundary has more than 400 pieces, or a piece with more
        points than are followed, or a grid point more than 20 trims; empty; or complete: every
        sheet found has been covered."""
        words = {part.status for part in self.parts}
        return next(w for w in ("interrupted", "incomplete", "complete", "empty") if w in words)

    @property
    def pieces(self) -> List[EnvelopePiece]:
        """The pieces of the boundary, of all parts."""
        return [piece for part in self.parts for piece in part.pieces]

    @property
    def rows(self) -> List[Tuple[float, List[Tuple[float, str, float, str]]]]:
        """(over, [(from, what ends it, to, what ends it)]), of all parts."""
        return [row for part in self.parts for row in part.rows]

    def __bool__(self) -> bool:
        return self.status == "complete"

    def to_dataframe(self) -> Any:
        """A pandas.DataFrame of the boundary's points; needs pandas."""
        pd = need("pandas", "pandas", "to_dataframe()")
        m = self.model
        names = [s.name for s in (*m.states, *m.inputs, *m.outputs)]
        columns: Dict[str, Any] = {
            "piece": [i for i, p in enumerate(self.pieces) for _ in range(len(p))],
            "stopped_by": [p.name for p in self.pieces for _ in range(len(p))],
            self.along.name: _joined([p.along for p in self.pieces]),
            self.over.name: _joined([p.over for p in self.pieces]),
            "outer": [bool(one) for p in self.pieces for one in p.outer],
        }
        for name in names:
            columns.setdefault(name, _joined([p[name] for p in self.pieces]))
        return pd.DataFrame(columns)

    def _page(self) -> Page:
        rows = [
            [number(at), number(low), low_by, number(high), high_by]
            for at, intervals in self.rows
            for low, low_by, high, high_by in intervals or [(np.nan, "no trim", np.nan, "")]
        ]
        name, unit = self.along.name, self.along.unit
        headings = [self.over.name, f"{name} from", "stopped by", f"{name} to", "stopped by"]
        table = Table(headings, rows, [self.over.unit, unit, "", unit, ""], left=(2, 4))
        return Page(f"{self.status}: {self.model.name}", [], [table])


def _joined(columns: Sequence[Array]) -> Array:
    return np.concatenate(columns) if columns else np.array([])


@of_studies
@shows_fields
def envelope(
    what: Union[Model, Problem, Condition, TrimResult],
    guess: Optional[Guess] = None,
    *,
    along: Optional[Tuple[str, float, float]] = None,
    over: Union[None, str, Tuple[str, float, float]] = None,
    count: Optional[int] = None,
    rows: Optional[Sequence[float]] = None,
    progress: Progress = None,
    spec: Optional[TrimSpec] = None,
    **fields: Unpack[TrimFields],
) -> Envelope:
    """The region of two parameters with trims within the limits, and its boundary.

    what  : a closed-loop Condition: V over "eta_deg" (the conversion corridor) or "gamma_deg", or
            its study's [envelope]; a Model with a guess and a trim specification, a Problem or a
            TrimResult, with `along` and `over`; a Study or its path: {name: envelope}, or the one
            of condition=
    along, over : (signal, lower, upper): variables that the trim does not solve for; of a
            Condition `over` alone, a name
    count : grid points along each axis; default: 100, or the study's
    rows  : values of `over` at which intervals of `along` are computed; default: every tenth of the
            range, of an angle every 10°
    progress : True, or progress(done, total, text): returning False stops with what there is

    As many unknowns as equations. Sheets of trims that no start reaches are not found
    (docs/follow.md).
    """
    own = spec_of("envelope", spec, fields)
    if count is not None:
        count = whole("count", count, 1000)
    with told(progress) as tell:
        if isinstance(what, Condition):
            return _of_condition(what, along, over, count, rows, tell)
        model, own, at = asked(what, guess, own, "envelope")
        if along is None or over is None or isinstance(over, str):
            raise TypeError("envelope() needs along= and over=, each (signal, lower, upper)")
        low, high = pair("over", over[1:])
        count = 100 if count is None else count
        wanted = np.linspace(low, high, 11) if rows is None else np.array(_rows(rows))
        axes = [(along[0], *pair("along", along[1:]), count), (over[0], low, high, count)]
        raw = _tiltrim.envelope(
            model._core, own._fields(), at._tuple(), axes[0], axes[1], wanted.tolist(), tell
        )
        return _envelope(raw, model, _signal(model, along[0]), _signal(model, over[0]))


def _rows(given: Sequence[float]) -> List[float]:
    rows = [real("rows", row) for row in given]
    if not np.isfinite(rows).all():
        raise _tiltrim.InvalidArgument(f"rows: expected finite numbers, got {rows}")
    return rows


def _of_condition(
    condition: Condition, along: Any, over: Any, count: Any, rows: Any, tell: Any
) -> Envelope:
    if along is not None or not (over is None or isinstance(over, str)):
        raise TypeError(
            "envelope() of a Condition: its study has the ranges; expected over='eta_deg' or "
            "'gamma_deg'"
        )
    wanted = None if rows is None else _rows(rows)
    raw = _tiltrim.envelope_condition(condition._core, over or "", count, wanted, tell)
    model = Model._of(raw["model"], (_model_along, (condition,)))
    return _envelope(raw, model, Signal(*raw["along"]), Signal(*raw["over"]))


def _model_along(condition: Condition) -> Model:
    core = _tiltrim.envelope_model(condition._core)
    return Model._of(core, (_model_along, (condition,)))


def _envelope(raw: Dict[str, Any], model: Model, along: Signal, over: Signal) -> Envelope:
    parts = []
    for part in raw["parts"]:
        for piece in part["pieces"]:
            piece["points"] = [Point(model, *point) for point in piece["points"]]
            piece["outer"] = np.array(piece["outer"], dtype=bool)
            piece["outputs"] = np.array(piece["outputs"], dtype=float).reshape(
                len(piece["points"]), len(model.outputs)
            )
        part["pieces"] = [EnvelopePiece(**piece) for piece in part["pieces"]]
        part["rows"] = [(at, list(intervals)) for at, intervals in part["rows"]]
        parts.append(EnvelopePart(**part))
    return Envelope(model, along, over, parts, raw["exception"])
