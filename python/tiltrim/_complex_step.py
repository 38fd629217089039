"""Derivatives of Python functions that take complex numbers: Im f(z + ih)/h, exact to rounding."""

from __future__ import annotations

from typing import Any, Callable, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

STEP = 1e-100  # its square vanishes next to any number: no truncation, no cancellation


class ComplexStep:
    """derivatives(x, u, p) of [f; h] by the complex step.

    At the first three points it is compared with differences: at the first alone a wrong slope may be
    right by chance, as that of V |V| at V = 0. It returns what is wrong as text if f or h does
    not take complex numbers or loses their imaginary parts.
    """

    def __init__(
        self,
        f: Optional[Callable[..., Any]],
        h: Optional[Callable[..., Any]],
        rows: Sequence[str],
        variables: Sequence[str],
        nominals: Sequence[float],
        ends: Tuple[int, int],
        vectorized: bool = False,
    ) -> None:
        self.functions = [function for function in (f, h) if function is not None]
        self.rows, self.variables = list(rows), list(variables)
        self.nominals = np.array(nominals, float)
        self.ends = ends
        self.vectorized = vectorized
        self.to_check = 3
        self.last: Optional[NDArray[np.float64]] = None  # point checked

    def __call__(self, x: Any, u: Any, p: Any) -> Union[NDArray[np.float64], str]:
        z = np.concatenate([x, u, p])
        ends = [len(x), len(x) + len(u)]
        if self.to_check == 0 or (self.last is not None and np.array_equal(z, self.last)):
            return self.jacobian(z, ends)
        here = self.values(z, ends).real
        try:
            J = self.jacobian(z, ends)
        except Exception as error:  # noqa: BLE001 (whatever the model raises)
            return f"it takes no complex numbers ({type(error).__name__}: {error})"
        wrong = self.compare(J, here, z, ends)
        if not wrong:
            self.to_check, self.last = self.to_check - 1, z
        return wrong or J

    def columns(self, z: NDArray[Any], ends: Sequence[int]) -> NDArray[Any]:
        """[f; h] of a vectorized model at many points: shape (nx + ny, N)."""
        rows = []
        for g in self.functions:
            answer = g(*np.split(z.copy(), ends))
            rows += [np.broadcast_to(row, z.shape[1:]) for row in answer]
        return np.array(rows)

    def at_points(self, z: NDArray[np.float64], along: Sequence[int]) -> NDArray[np.float64]:
        """[f; h] at N points, and its derivatives by some variables: shape (rows, (1 + c) N)."""
        many = z.shape[1]
        if not along:
            return self.columns(z, self.ends)
        ahead = np.tile(z.astype(complex), 1 + len(along))
        for block, j in enumerate(along, 1):
            ahead[j, block * many : (block + 1) * many] += 1j * STEP
        answer = self.columns(ahead, self.ends)
        return np.hstack([answer[:, :many].real, answer[:, many:].imag / STEP])

    def values(self, z: NDArray[Any], ends: List[int]) -> NDArray[Any]:
        if self.vectorized:
            return np.asarray(self.columns(z[:, None], ends)[:, 0], complex)
        answers = [g(*np.split(z.copy(), ends)) for g in self.functions]
        parts = [np.ravel(np.asarray(answer, complex)) for answer in answers]
        return np.concatenate(parts) if parts else np.zeros(0, complex)

    def jacobian(self, z: NDArray[np.float64], ends: List[int]) -> NDArray[np.float64]:
        if self.vectorized:
            every = self.columns(z[:, None] + 1j * STEP * np.eye(len(z)), ends)
            return np.asarray(every.imag / STEP)
        J = np.zeros((len(self.rows), len(z)))
        for j in range(len(z)):
            ahead = z.astype(complex)
            ahead[j] += 1j * STEP
            J[:, j] = self.values(ahead, ends).imag / STEP
        return J

    def compare(
        self,
        J: NDArray[np.float64],
        here: NDArray[np.float64],
        z: NDArray[np.float64],
        ends: List[int],
    ) -> str:
        """What differs from differences by more than their error, as text.

        At a kink one of the two one-sided differences may agree.
        """
        for j, nominal in enumerate(self.nominals):
            samples = []
            for steps in (-2, -1, 1, 2):
                to = z.copy()
                to[j] += steps * 1e-6 * nominal
                samples.append(self.values(to, ends).real)
            far_below, near_below, near_above, far_above = samples
            h = (z[j] + 1e-6 * nominal) - z[j] or 1e-6 * nominal
            with np.errstate(all="ignore"):
                above, below = (near_above - here) / h, (here - near_below) / h
                doubled = (far_above - far_below) / (4 * h)
                central = (above + below) / 2
                size = np.max(np.abs([here, near_above, near_below]), axis=0)
                allowed = 1e-4 * np.abs(central) + 10 * np.abs(central - doubled)
                allowed += 1e-14 * size / h
                apart = np.min(np.abs(np.array([central, above, below]) - J[:, j]), axis=0)
            for i in np.flatnonzero(apart > allowed):
                return (
                    f"d{self.rows[i]}/d{self.variables[j]} is {J[i, j]:.6g} by the complex step and "
                    f"{central[i]:.6g} by differences: a function in it is not analytic or loses the "
                    "imaginary part (abs, conj, real, float, arctan2, an array of floats)"
                )
        return ""
