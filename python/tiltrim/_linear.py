"""linearize and modes: linear models with error bounds, eigenvalues with a stability verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tiltrim
from ._arguments import listed_names, real
from ._models import Array, Model, Point, Signal
from ._needs import need
from ._problems import Bound, Guess, Problem, _range
from ._show import Page, Plotted, Shown, Table, fixed, number
from ._studies import Condition, NoLinearModel, of_studies
from ._trim import TrimResult, trim

Complex = NDArray[np.complex128]


@dataclass(repr=False)
class LinearModel(Shown):
    """dx' = A dx + B du, dy = C dx + D du at a point, with an error bound for every entry.

    A has shape (nx, nx), B (nx, nu), C (ny, nx), D (ny, nu), in the signals' units. True if the
    status is "linear"; else there are no matrices, and message gives the reason.
    """

    status: str  #: linear, not_equilibrium, not_finite, model_threw, not_repeatable, time_limit
    states: Tuple[Signal, ...]
    inputs: Tuple[Signal, ...]
    outputs: Tuple[Signal, ...]
    point: Point
    rates: Array  #: residual rates at the point, shape (nx,)
    residual: float  #: the largest rate over its nominal size, 1/s
    A: Array
    B: Array
    C: Array
    D: Array
    A_error: Array
    B_error: Array
    C_error: Array
    D_error: Array
    method: str  #: exact or differences
    A_differences: Optional[Array]  #: for comparison with an exact A
    A_differences_error: Optional[Array]
    remarks: List[str]
    message: str
    exception: Optional[BaseException] = None  #: the first raised by the model's functions

    def __bool__(self) -> bool:
        return self.status == "linear"

    def _check(self) -> None:
        if not self:
            raise NoLinearModel(f"no linear model: {self.message or self.status}")

    def _matrices(self) -> Tuple[Tuple[Array, Array, Array, Array], List[str]]:
        # Without outputs y is the state.
        self._check()
        if self.outputs:
            return (self.A, self.B, self.C, self.D), [s.name for s in self.outputs]
        nx, nu = len(self.states), len(self.inputs)
        return (self.A, self.B, np.eye(nx), np.zeros((nx, nu))), [s.name for s in self.states]

    def to_scipy(self) -> Any:
        """A scipy.signal.StateSpace; for a model without outputs, y is the state."""
        signal = need("scipy.signal", "scipy", "to_scipy()")
        (A, B, C, D), _ = self._matrices()
        return signal.StateSpace(A, B, C, D)

    def to_control(self) -> Any:
        """A control.StateSpace with the signals' names; without outputs, y is the state."""
        control = need("control", "control", "to_control()")
        (A, B, C, D), outputs = self._matrices()
        return control.ss(
            A,
            B,
            C,
            D,
            states=[s.name for s in self.states],
            inputs=[s.name for s in self.inputs],
            outputs=outputs,
        )

    def _page(self) -> Page:
        name = self.point.model.name
        if not self:
            return Page(f"{self.status}: {name}", [self.message])
        lines = [
            f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs; "
            f"residual {self.residual:.1g} 1/s",
            f"{self.method}, error of A at most {self.A_error.max(initial=0.0):.1g}",
            *self.remarks,
        ]
        headings = [""] + [s.name for s in (*self.states, *self.inputs)]
        rows = [
            [f"{s.name}'", *_entries(self.A[i], self.A_error[i]), *_entries(self.B[i], self.B_error[i])]
            for i, s in enumerate(self.states)
        ] + [
            [s.name, *_entries(self.C[i], self.C_error[i]), *_entries(self.D[i], self.D_error[i])]
            for i, s in enumerate(self.outputs)
        ]
        return Page(f"{self.status}: {name}", lines, [Table(headings, rows, left=(0,))])


@dataclass(repr=False)
class Mode(Shown):
    """An eigenvalue of A and its properties; a complex pair is two modes."""

    eigenvalue: complex  #: 1/s
    frequency: float  #: |eigenvalue|, rad/s
    damping: float  #: -Re(eigenvalue)/|eigenvalue|; NaN if 0 lies within the error of an eigenvalue that is not 0
    time_to_half: float  #: s; time to double if unstable; NaN if the error leaves open which
    error: float  #: bound: a true eigenvalue lies within it
    condition: float
    backward_error: float
    right: Complex  #: eigenvector, shape (nx,)
    left: Complex
    participation: Array  #: of each state, shape (nx,); sums to one, or all zero if not determined
    name: str
    determined: bool

    def _page(self) -> Page:
        return Page(f"{self.name}: {_complex(self.eigenvalue)} 1/s")


@dataclass(repr=False)
class Modes(Plotted):
    """Eigenvalues by rising real part, with error bounds, mode names and a verdict."""

    verdict: str  #: stable, unstable, or undecided: the bounds include the imaginary axis
    spectral_abscissa: float  #: largest real part, 1/s
    states: Tuple[str, ...]
    converged: bool
    _columns: Dict[str, Any]  # by the names and in the order of Mode's fields, each of all modes

    @cached_property
    def modes(self) -> List[Mode]:
        """All modes, made when first asked for."""

        def each(column: Any) -> Any:
            """One of each mode: Python's own numbers of an array, rows of a matrix, names."""
            return column.tolist() if getattr(column, "ndim", None) == 1 else column

        return [Mode(*values) for values in zip(*map(each, self._columns.values()))]

    @property
    def eigenvalues(self) -> Complex:
        """All eigenvalues, 1/s, shape (nx,)."""
        return np.array(self._columns["eigenvalue"])

    @property
    def frequency(self) -> Array:
        """|eigenvalue|, rad/s, shape (nx,)."""
        return np.array(self._columns["frequency"])

    @property
    def damping(self) -> Array:
        """Damping ratios, shape (nx,)."""
        return np.array(self._columns["damping"])

    @property
    def error(self) -> Array:
        """Error bounds of the eigenvalues, 1/s, shape (nx,)."""
        return np.array(self._columns["error"])

    @property
    def names(self) -> List[str]:
        """Names of the modes, from the participating states."""
        return list(self._columns["name"])

    def __getitem__(self, number: int) -> Mode:
        return self.modes[number]

    def __len__(self) -> int:
        return len(self._columns["eigenvalue"])

    def __bool__(self) -> bool:
        return self.verdict == "stable"

    def _page(self) -> Page:
        rows = []
        for m in self.modes:
            if m.eigenvalue.imag < 0:
                continue  # together with its conjugate
            # Shares that are equal but for rounding stay in the order of the states.
            shares = sorted(zip(m.participation, self.states), key=lambda share: -round(float(share[0]), 9))
            taking_part = ", ".join(f"{n} {100 * s:.0f} %" for s, n in shares if s >= 0.1)
            rows.append(
                [
                    _complex(m.eigenvalue),
                    f"{m.error:.0e}",
                    fixed(m.frequency, 4),
                    fixed(m.damping, 3) if m.frequency > m.error else "-",
                    "-" if math.isnan(m.time_to_half) else f"{m.time_to_half:.3g}",
                    m.name,
                    taking_part,
                ]
            )
        table = Table(
            ["eigenvalue", "± bound", "frequency", "damping", "t half", "mode", "participation"],
            rows,
            ["1/s", "1/s", "rad/s", "", "s", "", ""],
            left=(5, 6),
        )
        return Page(self.verdict, [] if self.modes else ["no states, no modes"], [table])


def _complex(value: complex) -> str:
    if value.imag == 0:
        return fixed(value.real, 4)
    if abs(value.real) < 5e-5:  # on the axis, to what is printed
        return f"±{fixed(abs(value.imag), 4)}i"
    return f"{fixed(value.real, 4)} ± {fixed(abs(value.imag), 4)}i"


@of_studies
def linearize(
    what: Union[Model, TrimResult, Problem, Condition],
    point: Optional[Guess] = None,
    *,
    method: str = "exact",
    inputs: Sequence[str] = (),
    bounds: Optional[Mapping[str, Bound]] = None,
    tolerance: float = 1e-6,
    moving: Sequence[str] = (),
    time_limit: Optional[float] = None,
) -> LinearModel:
    """Linearizes a model at an equilibrium.

    what   : a Model, with a point; a TrimResult; a Problem or a Condition, which are trimmed first;
             or a Study or its path: {name: linear model}, or the one of condition=
    method : "exact", the model's own derivatives where it has them; or "differences"
    inputs : of the linear model; default: the model's, and V, gamma, eta of a closed loop of the
             tiltrotor that is given as a Condition or its trim
    bounds : {variable: (lower, upper)}; differences do not step outside
    tolerance : largest rate over its nominal size at an equilibrium, 1/s
    moving : states whose rates need not vanish; default: those that the trim did not hold at zero
    time_limit : s of wall clock, of the trim and of the linear model each; default: a Condition's
             study may have one, else none
    """
    inputs, moving = listed_names("inputs", inputs), listed_names("moving", moving)
    tolerance = real("tolerance", tolerance)
    if isinstance(what, Condition) and what.formulation == "table":
        raise NoLinearModel("no linear model: formulation table has no rates")
    if isinstance(what, (Problem, Condition)):
        trimmed = trim(what, time_limit=time_limit)
    elif isinstance(what, TrimResult):
        trimmed = what
    else:
        if point is None:
            raise TypeError("linearize() of a model needs a point: values by name, or a Point")
        at = what.point(point)
        return _linearize(what, at, method, inputs, bounds, tolerance, moving, time_limit)
    model = trimmed.model
    inputs = inputs or trimmed._linear_inputs
    at = trimmed.point if point is None else model.point(point)
    moving = moving or trimmed._moving()
    linear = _linearize(model, at, method, inputs, bounds, tolerance, moving, time_limit)
    if not linear and point is None and not trimmed:
        why = f"the trim ended with {trimmed.status}: {trimmed.message}; {linear.message}"
        status = "time_limit" if trimmed.status == "time_limit" else linear.status
        return replace(linear, status=status, message=why)
    return linear


def _linearize(
    model: Model,
    point: Point,
    method: str,
    inputs: Sequence[str],
    bounds: Optional[Mapping[str, Bound]],
    tolerance: float,
    moving: Sequence[str],
    time_limit: Optional[float],
) -> LinearModel:
    raw = _tiltrim.linearize(
        model._core,
        point._tuple(),
        method,
        list(inputs),
        {name: _range(bound) for name, bound in (bounds or {}).items()},
        tolerance,
        list(moving),
        math.inf if time_limit is None else float(time_limit),
    )
    for signals in ("states", "inputs", "outputs"):
        raw[signals] = tuple(Signal(*s) for s in raw[signals])
    raw["point"] = Point(model, *raw["point"])
    return LinearModel(**raw)


@of_studies
def modes(
    what: Union[LinearModel, TrimResult, Problem, Condition, ArrayLike],
    error: Optional[ArrayLike] = None,
    states: Sequence[str] = (),
    *,
    time_limit: Optional[float] = None,
) -> Modes:
    """Eigenvalues with error bounds, mode names and a stability verdict.

    what   : a LinearModel; a matrix A of shape (n, n), 1/s; or what linearize() takes. Of a study
             all conditions but those without an equilibrium, or the one of condition=
    error  : bounds of the entries of such a matrix, shape (n, n); default: none
    states : names for its states; default: x1, x2, ...
    time_limit : as of linearize()

    Without states, as of a matrix of shape (0, 0), there are no modes and nothing that could be
    unstable: "stable", with a spectral abscissa of -inf.

    Raises ValueError for a matrix that is not square or not finite, or if no linear model exists.
    """
    if isinstance(what, (TrimResult, Problem, Condition)):
        what = linearize(what, time_limit=time_limit)
    if isinstance(what, LinearModel):
        what._check()
        names = [s.name for s in what.states]
        return _modes(_tiltrim.modes(what.A, what.A_error, names), names)
    A = _matrix(what, "A")
    bound = np.zeros((0, 0)) if error is None else _matrix(error, "the error of A")
    names = list(states) or [f"x{i + 1}" for i in range(len(A))]
    return _modes(_tiltrim.modes(A, bound, names), names)


def _entries(values: Array, errors: Array) -> list[str]:
    """In words; 0 where a value of rounding noise is below its own error."""
    noise = 1e-12 * max(1.0, float(abs(values).max(initial=0.0)))
    return [number(0.0 if abs(v) <= min(e, noise) else v) for v, e in zip(values, errors)]


def _matrix(given: Any, what: str) -> Array:
    matrix = np.asarray(given)
    if matrix.dtype.kind not in "fiub" or matrix.ndim != 2:
        raise _tiltrim.InvalidArgument(f"{what}: expected a matrix of real numbers, got {given!r}")
    return np.asarray(matrix, dtype=float)


def _modes(raw: Dict[str, Any], names: Sequence[str]) -> Modes:
    return Modes(
        raw["verdict"], raw["spectral_abscissa"], tuple(names), raw["converged"], raw["columns"]
    )


@dataclass(repr=False)
class Bode(Plotted):
    """Frequency response from one input to one output of a linear model."""

    input: str
    output: str
    unit: str  #: of the gain, output over input
    frequency: Array  #: rad/s
    response: Complex  #: C (jωI - A)⁻¹ B + D

    @property
    def magnitude(self) -> Array:
        """|response|, in `unit`."""
        return np.abs(self.response)

    @property
    def phase(self) -> Array:
        """Phase in rad, without jumps of 2π."""
        return np.unwrap(np.angle(self.response))

    def _page(self) -> Page:
        span = f"{number(float(self.frequency[0]))} to {number(float(self.frequency[-1]))} rad/s"
        return Page(f"{self.output} by {self.input}: {len(self.frequency)} frequencies, {span}")


@of_studies
def bode(
    what: Union[LinearModel, TrimResult, Problem, Condition],
    input: str,
    output: str,
    frequency: Optional[ArrayLike] = None,
) -> Bode:
    """The frequency response of a linear model, or of what linearize() takes; condition= as there.

    input, output : names; a state is an output too
    frequency     : rad/s, one or several, rising; default: 200 from a tenth of the slowest
                    eigenvalue (or 0.01) to ten times the fastest (or 100)

    Raises ValueError for frequencies that are not finite and above 0, and for one at which a pole
    lies on the imaginary axis: the response is infinite there.
    """
    linear = what if isinstance(what, LinearModel) else linearize(what)
    linear._check()
    rows = np.vstack([linear.C, np.eye(len(linear.states))])
    outputs = (*linear.outputs, *linear.states)
    j = _place(input, [s.name for s in linear.inputs], "input")
    i = _place(output, [s.name for s in outputs], "output")
    given = _frequencies(linear) if frequency is None else frequency
    omega = np.atleast_1d(np.asarray(given, dtype=float))
    is_list = omega.ndim == 1 and omega.size > 0 and np.all(np.isfinite(omega))
    if not is_list or not np.all(np.diff(omega) > 0) or not omega[0] > 0:
        raise _tiltrim.InvalidArgument("frequency: expected finite, rising values above 0 rad/s")
    gain = [rows[i] @ _state_response(linear, j, w) for w in omega.tolist()]
    units = [outputs[i].unit, linear.inputs[j].unit]
    unit = "" if units[0] == units[1] else f"{units[0] or '1'}/{units[1] or '1'}"
    through = linear.D[i, j] if i < len(linear.outputs) else 0.0
    return Bode(input, output, unit, omega, np.array(gain) + through)


def _state_response(linear: LinearModel, input: int, omega: float) -> Complex:
    I = np.eye(len(linear.states))  # noqa: E741
    try:
        x: Complex = np.linalg.solve(1j * omega * I - linear.A, linear.B[:, input])
    except np.linalg.LinAlgError:
        x = np.full(len(linear.states), np.inf, dtype=complex)
    if not np.all(np.isfinite(x)):
        raise _tiltrim.InvalidArgument(
            f"frequency: a pole lies at {omega:.6g} rad/s, where the response is infinite"
        )
    return x


def _place(name: str, names: Sequence[str], what: str) -> int:
    if name not in names:
        raise _tiltrim.InvalidArgument(f"no {what} '{name}'; there are: {', '.join(names)}")
    return list(names).index(name)


def _frequencies(linear: LinearModel) -> Array:
    sizes = [size for size in np.abs(np.linalg.eigvals(linear.A)) if size > 1e-6]
    slowest, fastest = (min(sizes), max(sizes)) if sizes else (0.1, 10.0)
    return np.geomspace(slowest / 10, 10 * fastest, 200)
