"""What is asked of a trim, in the user's words; counted and checked before any number moves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

from ._models import Effort, Model, Point, point_table
from ._show import Page, Shown

Guess = Union[Mapping[str, float], Point]
#: lower and upper; None is no bound, equal ends hold the signal there
Bound = Tuple[Optional[float], Optional[float]]


@dataclass(frozen=True)
class TrimSpec:
    """What a trim is asked: which signals may move, which rates are held.

    free    : names of states, inputs or parameters that may move
    still   : names of states whose rates are zero
    rates   : {state: rate that is held}, in its unit per second
    bounds  : {variable or output: (lower, upper)}
    implied : states whose rates must vanish as a consequence; verified
    effort  : what decides where there are more unknowns than equations; empty: every free input
              over its nominal size
    """

    free: Sequence[str] = ()
    still: Sequence[str] = ()
    rates: Mapping[str, float] = field(default_factory=dict)
    bounds: Mapping[str, Bound] = field(default_factory=dict)
    implied: Sequence[str] = ()
    effort: Sequence[Effort] = ()

    def __post_init__(self) -> None:
        for name in ("free", "still", "implied"):
            given = getattr(self, name)
            if isinstance(given, str):
                raise TypeError(f"{name}: expected a list of names, got the string {given!r}")
            object.__setattr__(self, name, tuple(given))
        object.__setattr__(self, "effort", tuple(Effort(*_listed(e)) for e in self.effort))

    def _asked(self) -> bool:
        return bool(self.free or self.still or self.rates)

    def _fields(self) -> Dict[str, Any]:
        return {
            "free": list(self.free),
            "still": list(self.still),
            "rates": {name: float(rate) for name, rate in self.rates.items()},
            "bounds": {name: _range(bound) for name, bound in self.bounds.items()},
            "implied": list(self.implied),
            "effort": [tuple(e) for e in self.effort],
        }


def _listed(effort: Any) -> Tuple[Any, ...]:
    return (effort,) if isinstance(effort, str) else tuple(effort)


def _range(bound: Bound) -> Tuple[float, float]:
    lower, upper = bound
    return (
        -math.inf if lower is None else float(lower),
        math.inf if upper is None else float(upper),
    )


class Problem(Shown):
    """A trim problem ready to solve: a model, what is asked (see TrimSpec), where to start.

    Several of them, named, are the points of a sweep or a tuning.
    """

    def __init__(
        self,
        model: Model,
        guess: Guess,
        *,
        name: str = "",
        free: Sequence[str] = (),
        still: Sequence[str] = (),
        rates: Optional[Mapping[str, float]] = None,
        bounds: Optional[Mapping[str, Bound]] = None,
        implied: Sequence[str] = (),
        effort: Sequence[Effort] = (),
        spec: Optional[TrimSpec] = None,
    ) -> None:
        self.model = model
        self.guess = model.point(guess)
        self.spec = spec or TrimSpec(free, still, rates or {}, bounds or {}, implied, effort)
        self.name = name or model.name

    def _page(self) -> Page:
        notes = {name: "free" for name in self.spec.free}
        lines = [
            "still: " + ", ".join(self.spec.still) if self.spec.still else "",
            "held: " + ", ".join(f"{n}' = {v:g}" for n, v in self.spec.rates.items())
            if self.spec.rates
            else "",
            *(
                f"{name} in [{lower:g}, {upper:g}]"
                for name, (lower, upper) in ((n, _range(b)) for n, b in self.spec.bounds.items())
            ),
        ]
        return Page(f"problem {self.name}", lines, [point_table(self.guess, notes)])
