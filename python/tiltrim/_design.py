"""lqr, place, lyapunov, hinf_norm, h2_norm: state feedback and norms of linear models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, List, Mapping, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _tiltrim
from ._linear import Complex, LinearModel, _complex, _matrix, _place
from ._models import Array
from ._show import Page, Shown, Table, number

#: a matrix, its diagonal, or its diagonal by the names of signals
Weights = Union[ArrayLike, Mapping[str, float]]


@dataclass(repr=False)
class Regulator(Shown):
    """The regulator u = -K x of least cost. True if the status is "optimal"."""

    status: str  #: optimal, not_stabilizable, not_detectable, inaccurate
    K: Array  #: shape (nu, nx)
    S: Array  #: shape (nx, nx): the least cost from x is x' S x
    poles: Complex  #: eigenvalues of A - B K, 1/s
    residual: float  #: of the Riccati equation, over the norms of its terms
    modes: Complex  #: eigenvalues of A because of which there is no regulator, 1/s
    states: Tuple[str, ...]
    inputs: Tuple[str, ...]

    def __bool__(self) -> bool:
        return self.status == "optimal"

    def _page(self) -> Page:
        lines = [f"poles {_list(self.poles)}"] if self.poles.size else []
        if self.modes.size:
            lines.append(f"because of {_list(self.modes)}")
        return Page(self.status, lines, [_gains(self.K, self.states, self.inputs)])


@dataclass(repr=False)
class Placement(Shown):
    """Feedback u = -K x with chosen poles. True if the status is "placed"."""

    status: str  #: placed, uncontrollable, inaccurate
    K: Array  #: shape (nu, nx)
    poles: Complex  #: eigenvalues of A - B K, 1/s
    residual: float  #: largest distance from the poles wanted, 1/s
    uncontrollable: Complex  #: eigenvalues of A that no input moves, 1/s
    states: Tuple[str, ...]
    inputs: Tuple[str, ...]

    def __bool__(self) -> bool:
        return self.status == "placed"

    def _page(self) -> Page:
        lines = [f"poles {_list(self.poles)}, off by {self.residual:.1g}"]
        if self.uncontrollable.size:
            lines.append(f"no input moves {_list(self.uncontrollable)}")
        return Page(self.status, lines, [_gains(self.K, self.states, self.inputs)])


@dataclass(repr=False)
class EquationSolution(Shown):
    """The solution X of a matrix equation. True if the status is "solved"."""

    status: str  #: solved, singular, inaccurate, not_converged
    X: Array
    residual: float  #: over the norms of the equation's terms

    def __bool__(self) -> bool:
        return self.status == "solved"

    def _page(self) -> Page:
        rows, columns = self.X.shape
        return Page(f"{self.status}: {rows} x {columns}, residual {self.residual:.1g}")


@dataclass(repr=False)
class Peak(Shown):
    """The H-infinity norm and its bounds. True if the status is "found"."""

    status: str  #: found, unstable (the norm is infinite), iteration_limit
    gain: float  #: largest singular value at `frequency`: a lower bound
    upper: float  #: no frequency reaches this gain, rounding included; inf: not determined
    frequency: float  #: rad/s; inf if only D has this gain

    def __bool__(self) -> bool:
        return self.status == "found"

    def _page(self) -> Page:
        return Page(f"{self.status}: {number(self.gain)} at {number(self.frequency)} rad/s")


@dataclass(repr=False)
class H2Norm(Shown):
    """The H2 norm; float(norm) is its value."""

    norm: float  #: inf if A is not stable or D is not zero
    error: float  #: relative, a bound; inf: not determined

    def __float__(self) -> float:
        return self.norm

    def _page(self) -> Page:
        return Page(f"{number(self.norm)}, relative error {self.error:.1g}")


def lqr(
    what: Union[LinearModel, Tuple[ArrayLike, ArrayLike]],
    Q: Weights,
    R: Weights,
    *,
    inputs: Sequence[str] = (),
) -> Regulator:
    """The state feedback u = -K x that minimizes the integral of x' Q x + u' R u.

    what   : a LinearModel, or its matrices (A, B)
    Q, R   : weights of states and inputs: a matrix, its diagonal, or values by signal name (states
             without one have 0)
    inputs : names of the inputs that the feedback uses; default: all

    >>> import tiltrim
    >>> found = tiltrim.lqr(([[0, 1], [0, 0]], [[0], [1]]), Q=[1, 0], R=[1])
    >>> found.status, found.K.round(6).tolist()
    ('optimal', [[1.0, 1.414214]])

    Raises ValueError for shapes that do not match, unknown names, an R that is not positive
    definite and a Q that is not positive semidefinite (docs/design.md).
    """
    A, B, states, names = _plant(what, inputs)
    raw = _tiltrim.lqr(A, B, _weights(Q, states, "Q"), _weights(R, names, "R"))
    return Regulator(**raw, states=states, inputs=names)


def place(
    what: Union[LinearModel, Tuple[ArrayLike, ArrayLike]],
    poles: ArrayLike,
    *,
    inputs: Sequence[str] = (),
) -> Placement:
    """State feedback u = -K x with which A - B K has the poles.

    what   : a LinearModel, or its matrices (A, B)
    poles  : one per state, 1/s; complex ones in conjugate pairs, any multiplicity
    inputs : names of the inputs that the feedback uses; default: all

    >>> import tiltrim
    >>> found = tiltrim.place(([[0, 1], [0, 0]], [[0], [1]]), [-3 + 4j, -3 - 4j])
    >>> found.status, found.K.round(6).tolist()
    ('placed', [[25.0, 6.0]])

    Raises ValueError for shapes that do not match, unknown names and a wrong number of poles.
    """
    A, B, states, names = _plant(what, inputs)
    wanted = np.asarray(poles)
    if wanted.dtype.kind not in "fiubc" or wanted.ndim != 1:
        raise _tiltrim.InvalidArgument(f"poles: expected a list of numbers, got {poles!r}")
    raw = _tiltrim.place(A, B, wanted.astype(complex))
    return Placement(**raw, states=states, inputs=names)


def lyapunov(what: Union[LinearModel, ArrayLike], Q: ArrayLike) -> EquationSolution:
    """X with A X + X A' + Q = 0: the covariance of the states under white noise of intensity Q.

    what : a LinearModel, or its matrix A
    Q    : symmetric, a matrix

    >>> import tiltrim
    >>> tiltrim.lyapunov([[-2.0]], [[1.0]]).X.tolist()
    [[0.25]]

    Raises ValueError for shapes that do not match and a Q that is not symmetric.
    """
    if isinstance(what, LinearModel):
        what._check()
    A = what.A if isinstance(what, LinearModel) else _matrix(what, "A")
    return EquationSolution(**_tiltrim.lyapunov(A, _matrix(Q, "Q")))


System = Union[LinearModel, Tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike]]


def hinf_norm(
    what: System,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    tolerance: float = 1e-8,
    max_levels: int = 30,
) -> Peak:
    """The largest gain from inputs to outputs over all frequencies, with its bounds.

    what            : a LinearModel, or its matrices (A, B, C, D)
    inputs, outputs : names; a state is an output too; default: all inputs, all outputs (of a model
                      without outputs its states)
    tolerance       : of the upper bound, relative
    max_levels      : Hamiltonian matrices; one or two suffice

    >>> import tiltrim
    >>> peak = tiltrim.hinf_norm(([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0]], [[0]]))
    >>> round(peak.gain, 6), round(peak.frequency, 6)
    (1.256297, 1.979899)

    Raises ValueError for shapes that do not match and unknown names.
    """
    return Peak(**_tiltrim.hinf_norm(*_system(what, inputs, outputs), tolerance, max_levels))


def h2_norm(what: System, *, inputs: Sequence[str] = (), outputs: Sequence[str] = ()) -> H2Norm:
    """The root of the outputs' variance if the inputs are white noise of unit intensity.

    what            : a LinearModel, or its matrices (A, B, C, D)
    inputs, outputs : names, as of hinf_norm()

    >>> import tiltrim
    >>> float(tiltrim.h2_norm(([[-2]], [[2]], [[1]], [[0]])))
    1.0

    Raises ValueError for shapes that do not match and unknown names.
    """
    return H2Norm(*_tiltrim.h2_norm(*_system(what, inputs, outputs)))


def _named(count: int, letter: str) -> Tuple[str, ...]:
    return tuple(f"{letter}{i + 1}" for i in range(count))


def _chosen(asked: Sequence[str], names: Sequence[str], what: str) -> List[int]:
    places = [_place(name, names, what) for name in asked]
    for i, name in enumerate(asked):
        if places[i] in places[:i]:
            raise _tiltrim.InvalidArgument(f"{what}s: '{name}' is listed twice; expected each once")
    return places


def _plant(
    what: Union[LinearModel, Tuple[ArrayLike, ArrayLike]], inputs: Sequence[str]
) -> Tuple[Array, Array, Tuple[str, ...], Tuple[str, ...]]:
    if isinstance(what, LinearModel):
        what._check()
        A, B = what.A, what.B
        states = tuple(s.name for s in what.states)
        names = tuple(s.name for s in what.inputs)
    else:
        A, B = _matrices(what, "AB")
        states, names = _named(A.shape[0], "x"), _named(B.shape[1], "u")
    if inputs:
        B = np.ascontiguousarray(B[:, _chosen(inputs, names, "input")])
        names = tuple(inputs)
    return A, B, states, names


def _system(
    what: System, inputs: Sequence[str], outputs: Sequence[str]
) -> Tuple[Array, Array, Array, Array]:
    if isinstance(what, LinearModel):
        (A, B, C, D), found = what._matrices()
        names = [s.name for s in what.inputs]
        states = [s.name for s in what.states]
        if outputs:  # states too
            C = np.vstack([what.C, np.eye(len(states))])
            D = np.vstack([what.D, np.zeros((len(states), len(names)))])
            found = [*(s.name for s in what.outputs), *states]
    else:
        A, B, C, D = _matrices(what, "ABCD")
        names, found = list(_named(B.shape[1], "u")), list(_named(C.shape[0], "y"))
    if inputs:
        columns = _chosen(inputs, names, "input")
        B, D = B[:, columns], D[:, columns]
    if outputs:
        rows = _chosen(outputs, found, "output")
        C, D = C[rows], D[rows]
    return A, B, C, D


def _matrices(given: Any, letters: str) -> Tuple[Array, ...]:
    if not isinstance(given, (tuple, list)) or len(given) != len(letters):
        raise TypeError(f"expected a LinearModel or ({', '.join(letters)}), got {given!r}")
    return tuple(_matrix(one, letter) for one, letter in zip(given, letters))


def _weights(given: Weights, names: Sequence[str], what: str) -> Array:
    if isinstance(given, Mapping):
        diagonal = np.zeros(len(names))
        for name, value in given.items():
            diagonal[_place(name, names, "signal")] = value
        return np.diag(diagonal)
    values = np.asarray(given)
    return np.diag(values.astype(float)) if values.ndim == 1 else _matrix(given, what)


def _list(values: Complex) -> str:
    return ", ".join(_complex(complex(v)) for v in values if v.imag >= 0)


def _gains(K: Array, states: Sequence[str], inputs: Sequence[str]) -> Table:
    rows = [[name, *(number(k) for k in row)] for name, row in zip(inputs, K)] if K.size else []
    return Table(["K", *states], rows, left=(0,))
