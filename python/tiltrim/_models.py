"""Signals, models and points: the arguments of the verbs."""

from __future__ import annotations

from numbers import Real
from typing import (
    Any,
    Callable,
    Dict,
    Iterable,
    Iterator,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Union,
)

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tiltrim
from ._arguments import mapping, real
from ._complex_step import ComplexStep
from ._show import Page, Shown, Table, number

Array = NDArray[np.float64]


class Signal(NamedTuple):
    """One component of a state, input, output or parameter vector.

    `nominal` is the size of a significant change: it scales steps, tolerances and rank tests.
    Wherever a Signal is expected, a tuple (name, unit, nominal) or a bare name is accepted.
    """

    name: str
    unit: str = ""
    nominal: float = 1.0


class Effort(NamedTuple):
    """One term ((signal - reference)/scale)² of the cost that selects among several trims."""

    signal: str
    scale: float = 1.0
    reference: float = 0.0


AnySignal = Union[Signal, str, Tuple[Any, ...]]
#: f(x, u, p) with arrays of shapes (nx,), (nu,), (np,); new arrays in each call
Callback = Callable[[Array, Array, Array], ArrayLike]
PointTuple = Tuple[Array, Array, Array]
#: a function and its arguments, which rebuild the model in another process
Made = Tuple[Callable[..., Any], Tuple[Any, ...]]


def _signals(given: Sequence[AnySignal], what: str) -> Tuple[Signal, ...]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise _tiltrim.InvalidArgument(f"{what}: expected a list of signals, got {given!r}")
    signals: List[Signal] = []
    for one in given:
        parts = (one,) if isinstance(one, str) or not isinstance(one, Iterable) else tuple(one)
        signal = Signal(*(parts if 1 <= len(parts) <= 3 else [None]))
        texts = (signal.name, signal.unit, signal.nominal)
        kinds = [isinstance(part, str) for part in texts]
        if kinds != [True, True, False] or not isinstance(signal.nominal, Real):
            raise _tiltrim.InvalidArgument(
                f"{what}: expected a name, a unit and a nominal size, got {one!r}"
            )
        for part in (signal.name, signal.unit):
            _check_text(what, part)
        signals.append(Signal(signal.name, signal.unit, float(signal.nominal)))
    return tuple(signals)


def _check_text(what: str, text: str) -> None:
    """Refuses a lone surrogate, which is in no UTF-8 text."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise _tiltrim.InvalidArgument(f"{what}: {text!r} is not valid Unicode text") from None


def _complex_step(
    f: Optional[Callback],
    h: Optional[Callback],
    states: Sequence[Signal],
    inputs: Sequence[Signal],
    outputs: Sequence[Signal],
    parameters: Sequence[Signal],
    vectorized: bool,
) -> ComplexStep:
    variables = [*states, *inputs, *parameters]
    rows = [f"{s.name}'" for s in states] + [s.name for s in outputs]
    nominals = [s.nominal for s in variables]
    ends = (len(states), len(states) + len(inputs))
    return ComplexStep(f, h, rows, [s.name for s in variables], nominals, ends, vectorized)


class Model(Shown):
    """x' = f(x, u, p), y = h(x, u, p): names, units and functions.

    name        : name of the model
    f           : f(x, u, p) -> rates, nx numbers in the states' units per second. None for a static
                  controller without states
    states, inputs, outputs, parameters : signals, in the order of the vectors
    h           : h(x, u, p) -> outputs, ny numbers; required if outputs are named
    derivatives : derivatives(x, u, p) -> array of shape (nx + ny, nx + nu + np), the exact
                  Jacobian of [f; h] with respect to [x; u; p]; default: finite differences;
                  "complex": from f and h themselves with complex arguments (numpy's functions
                  take them; abs, arctan2 and math's do not), compared once with differences
    switches    : {description: s(x, u, p) -> number, zero where f or h has a kink or a jump}
    vectorized  : f and h take many points at once: x, u, p of shapes (nx, N), (nu, N), (np, N),
                  answers of shape (nx, N) and (ny, N), or a list of rows, each of N numbers or one
                  for all. Differences are then one call, and with derivatives="complex" sweeps take
                  eight lines at a time. `derivatives` and `switches` still get vectors. The columns
                  are compared once with those of one point alone: InvalidArgument if they differ

    The functions receive copies and must depend only on their arguments. They may return a list,
    tuple, array or (for one value) a number; None, strings, complex numbers and wrong lengths or
    shapes raise InvalidArgument. NaN means that the model is undefined at the point.
    """

    def __init__(
        self,
        name: str,
        f: Optional[Callback],
        states: Sequence[AnySignal] = (),
        inputs: Sequence[AnySignal] = (),
        outputs: Sequence[AnySignal] = (),
        parameters: Sequence[AnySignal] = (),
        h: Optional[Callback] = None,
        derivatives: Union[Callback, str, None] = None,
        switches: Optional[Mapping[str, Callable[[Array, Array, Array], float]]] = None,
        vectorized: bool = False,
    ) -> None:
        by_complex = isinstance(derivatives, str) and derivatives == "complex"
        given: Any = None if by_complex else derivatives
        for what, function in (("f", f), ("h", h), ("derivatives", given)):
            if function is not None and not callable(function):
                or_complex = ' or "complex"' if what == "derivatives" else ""
                raise TypeError(
                    f"{what}: expected a function of (x, u, p){or_complex}, got {function!r}"
                )
        signals = (
            _signals(states, "states"),
            _signals(inputs, "inputs"),
            _signals(outputs, "outputs"),
            _signals(parameters, "parameters"),
        )
        kinks = dict(switches or {})
        for what, text in (("name", name), *(("switches", key) for key in kinks)):
            if isinstance(text, str):  # else the core's TypeError
                _check_text(what, text)
        slopes = _complex_step(f, h, *signals, vectorized) if by_complex else given
        lanes = slopes.at_points if by_complex and vectorized else None
        core = _tiltrim.Model(name, f, h, *signals, slopes, list(kinks.items()), vectorized, lanes)
        self._set(core, (Model, (name, f, *signals, h, derivatives, kinks, vectorized)))

    @classmethod
    def _of(cls, core: _tiltrim.Model, made: Made) -> Model:
        model = cls.__new__(cls)
        model._set(core, made)
        return model

    def __reduce__(self) -> Made:
        return self._made  # pickled as the function that made it

    def __deepcopy__(self, memo: object) -> Model:
        return self  # immutable

    def __copy__(self) -> Model:
        return self

    def _set(self, core: _tiltrim.Model, made: Made) -> None:
        self._core = core
        self._made = made
        self._states = tuple(Signal(*s) for s in core.states)
        self._inputs = tuple(Signal(*s) for s in core.inputs)
        self._outputs = tuple(Signal(*s) for s in core.outputs)
        self._parameters = tuple(Signal(*s) for s in core.parameters)
        variables = self._states + self._inputs + self._parameters
        self._place = {s.name: i for i, s in reversed(list(enumerate(variables)))}
        self._output_place = {s.name: i for i, s in enumerate(self._outputs)}

    @property
    def name(self) -> str:
        """Name of the model."""
        return self._core.name

    @property
    def states(self) -> Tuple[Signal, ...]:
        """Signals of x, nx of them."""
        return self._states

    @property
    def inputs(self) -> Tuple[Signal, ...]:
        """Signals of u, nu of them."""
        return self._inputs

    @property
    def outputs(self) -> Tuple[Signal, ...]:
        """Signals of y, ny of them."""
        return self._outputs

    @property
    def parameters(self) -> Tuple[Signal, ...]:
        """Signals of p."""
        return self._parameters

    @property
    def exact(self) -> bool:
        """Whether the model supplies exact derivatives."""
        return self._core.exact

    def point(
        self, values: Union[Mapping[str, float], Point, None] = None, **named: float
    ) -> Point:
        """A point of this model by names; unnamed states and inputs are 0.

        Every parameter must be given: raises ValueError with the missing ones.
        """
        if isinstance(values, Point):
            point = values.copy()
            point._check_fits(self)
        else:
            given = mapping("point", values, "values by name or a Point")
            given.update(named)
            missing = [s.name for s in self._parameters if s.name not in given]
            if missing:
                raise _tiltrim.InvalidArgument(
                    f"no value for {'the parameter' if len(missing) == 1 else 'the parameters'} "
                    + ", ".join(f"'{name}'" for name in missing)
                )
            point = Point(self)
            named = given
        for name, value in named.items():
            point[name] = value
        return point

    def evaluate(self, point: Union[Mapping[str, float], Point]) -> Tuple[Array, Array]:
        """Rates, shape (nx,), and outputs, shape (ny,), at a point."""
        return _tiltrim.evaluate(self._core, self.point(point)._tuple())

    def _page(self) -> Page:
        kinds = (
            ("state", self._states),
            ("input", self._inputs),
            ("output", self._outputs),
            ("parameter", self._parameters),
        )
        rows = [
            [kind if i == 0 else "", s.name, s.unit, number(s.nominal)]
            for kind, signals in kinds
            for i, s in enumerate(signals)
        ]
        how = "exact derivatives" if self.exact else "derivatives by differences"
        table = Table(["", "name", "unit", "nominal"], rows, left=(0, 1, 2))
        return Page(f"{self.name or 'model'}: {how}", [], [table])


class Point(Shown):
    """A point of a model: arrays x, u, p, also accessible by name.

    point["gap"] is a state, input or parameter; x, u, p are arrays of shapes (nx,), (nu,), (np,).
    """

    def __init__(
        self,
        model: Model,
        x: Optional[ArrayLike] = None,
        u: Optional[ArrayLike] = None,
        p: Optional[ArrayLike] = None,
    ) -> None:
        self.model = model
        self.x = _vector(x, len(model.states), "state x")
        self.u = _vector(u, len(model.inputs), "input u")
        self.p = _vector(p, len(model.parameters), "parameters p")

    @classmethod
    def _holding(cls, model: Model, x: Array, u: Array, p: Array) -> Point:
        """The point of these arrays themselves, of the model's sizes."""
        point = cls.__new__(cls)
        point.model, point.x, point.u, point.p = model, x, u, p
        return point

    def _where(self, name: str) -> Tuple[Array, int]:
        place = self.model._place.get(name)
        if place is None:
            place = _tiltrim.variable(self.model._core, name)  # raises, with the names there are
        for values in (self.x, self.u, self.p):
            if place < len(values):
                return values, place
            place -= len(values)
        raise IndexError(name)

    def __getitem__(self, name: str) -> float:
        values, place = self._where(name)
        return float(values[place])

    def __setitem__(self, name: str, value: float) -> None:
        values, place = self._where(name)
        values[place] = real(name, value)

    def __contains__(self, name: object) -> bool:
        return name in self.model._place

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __len__(self) -> int:
        return len(self.x) + len(self.u) + len(self.p)

    def keys(self) -> List[str]:
        """Names of states, inputs and parameters, in order."""
        model = self.model
        return [s.name for s in (*model.states, *model.inputs, *model.parameters)]

    def as_dict(self) -> Dict[str, float]:
        """All values by name."""
        return {name: self[name] for name in self.keys()}

    def copy(self) -> Point:
        """An independent copy."""
        return Point(self.model, self.x, self.u, self.p)

    def replace(self, values: Optional[Mapping[str, float]] = None, **named: float) -> Point:
        """A copy with some values changed, by name."""
        point = self.copy()
        for name, value in {**(values or {}), **named}.items():
            point[name] = value
        return point

    def _tuple(self) -> PointTuple:
        return (self.x, self.u, self.p)

    def _check_fits(self, model: Model) -> None:
        own = self.model
        if own is not model and (own.states, own.inputs, own.parameters) != (
            model.states,
            model.inputs,
            model.parameters,
        ):
            raise _tiltrim.InvalidArgument(
                f"a point of the model '{own.name}' does not fit '{model.name}': their signals differ"
            )

    def _page(self) -> Page:
        return Page(f"point of {self.model.name or 'the model'}", [], [point_table(self)])


_float64 = np.dtype(np.float64)


def _vector(values: Optional[ArrayLike], size: int, what: str) -> Array:
    if values is None:
        return np.zeros(size)
    if type(values) is np.ndarray and values.dtype is _float64 and values.shape == (size,):
        return values.copy()
    given = np.asarray(values)
    if given.dtype.kind not in "fiub" or given.ndim > 1:
        raise _tiltrim.InvalidArgument(f"{what}: expected {size} real values, got {values!r}")
    vector: Array = np.array(given, dtype=float).reshape(-1)
    if vector.size != size:
        raise _tiltrim.InvalidArgument(f"{what}: expected {size} values, got {vector.size}")
    return vector


_most_parameters = 12  # longer lists show only those with a note


def point_table(point: Point, notes: Optional[Mapping[str, str]] = None) -> Table:
    """Name, value, unit and note (may be empty) of each variable of a point."""
    model = point.model
    many = len(model.parameters) > _most_parameters
    noted = notes or {}
    rows = [
        [kind if i == 0 else "", s.name, number(float(value)), s.unit, noted.get(s.name, "")]
        for kind, signals, values in (
            ("state", model.states, point.x),
            ("input", model.inputs, point.u),
            ("parameter", model.parameters, point.p),
        )
        for i, (s, value) in enumerate(zip(signals, values))
        if not (many and kind == "parameter" and s.name not in noted)
    ]
    if many:
        rows.append(["parameter", f"({len(model.parameters)} of them)", "", "", ""])
    return Table(["", "name", "value", "unit", ""], rows, left=(0, 1, 3, 4))


def feedback(plant: Model, controller: Model) -> Model:
    """Connects a controller to a plant by signal names.

    Each input of one that has the name of an output of the other, or else of a state, is
    connected to it; the others remain inputs. States, inputs, outputs and parameters are the
    plant's, then the controller's. Raises ValueError for name clashes, unit mismatches, no match,
    and algebraic loops.
    """
    core = _tiltrim.feedback(plant._core, controller._core)
    return Model._of(core, (feedback, (plant, controller)))


def close_loop(plant: Model, controller: Model) -> Model:
    """Earlier name of `feedback`."""
    return feedback(plant, controller)
