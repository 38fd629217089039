"""Trim specifications in the user's terms; counted and checked before solving."""

from __future__ import annotations

import inspect
import math
from dataclasses import dataclass, replace
from typing import (
    TYPE_CHECKING,
    Any,
    Callable,
    Dict,
    Mapping,
    Optional,
    Sequence,
    Tuple,
    TypedDict,
    TypeVar,
    Union,
)

from . import _tiltrim
from ._arguments import listed_names, mapping, real
from ._models import Effort, Model, Point, point_table
from ._show import Page, Shown

if TYPE_CHECKING:
    from typing_extensions import Unpack

Verb = TypeVar("Verb", bound=Callable[..., Any])
Guess = Union[Mapping[str, float], Point]
#: lower and upper; None is no bound, equal bounds fix the signal
Bound = Tuple[Optional[float], Optional[float]]


@dataclass(frozen=True, init=False)
class TrimSpec:
    """What a trim solves for: which signals are free, which rates are held.

    free    : names of states, inputs or parameters to solve for
    steady  : states whose rates are zero (formerly `still`); default: every state not named in
              rates, implied or moving
    rates   : {state: prescribed rate}, in its unit per second
    bounds  : {variable or output: (lower, upper)}
    implied : states whose rates must vanish as a consequence of the others; verified
    effort  : terms of the cost to minimize if there are more unknowns than equations; empty: every
              free input over its nominal size
    moving  : states whose rates are not constrained, such as a position

    If free, steady, rates and moving are all omitted, every state is free and steady.
    """

    free: Tuple[str, ...]
    steady: Tuple[str, ...]
    rates: Mapping[str, float]
    bounds: Mapping[str, Bound]
    implied: Tuple[str, ...]
    effort: Tuple[Effort, ...]
    moving: Tuple[str, ...]

    def __init__(
        self,
        free: Sequence[str] = (),
        steady: Sequence[str] = (),
        rates: Optional[Mapping[str, float]] = None,
        bounds: Optional[Mapping[str, Bound]] = None,
        implied: Sequence[str] = (),
        effort: Sequence[Effort] = (),
        *,
        moving: Sequence[str] = (),
        still: Optional[Sequence[str]] = None,
    ) -> None:
        if still is not None and steady:
            raise TypeError("still is the old name of steady: expected one of them, got both")
        for name, value in (
            ("free", listed_names("free", free)),
            ("steady", listed_names("steady", steady) if still is None else listed_names("still", still)),
            ("rates", mapping("rates", rates, "{state: rate}")),
            ("bounds", mapping("bounds", bounds, "{signal: (lower, upper)}")),
            ("implied", listed_names("implied", implied)),
            ("effort", tuple(Effort(*_listed(e)) for e in effort)),
            ("moving", listed_names("moving", moving)),
        ):
            object.__setattr__(self, name, value)  # frozen dataclass

    @property
    def still(self) -> Tuple[str, ...]:
        """Earlier name of `steady`."""
        return self.steady

    def _asked(self) -> bool:
        return bool(self.free or self.steady or self.rates or self.moving)

    def _of(self, model: Model) -> TrimSpec:
        """The specification for this model: by default every state is free."""
        return self if self._asked() else replace(self, free=tuple(s.name for s in model.states))

    def _ranks(self) -> bool:
        """Whether there is a region to search for the equilibrium of least effort, or an effort."""
        bounds = (_range(self.bounds.get(name, (None, None)), name) for name in self.free)
        return bool(self.effort) or all(math.isfinite(end) for one in bounds for end in one)

    def _fields(self) -> Dict[str, Any]:
        return {
            "free": list(self.free),
            "steady": list(self.steady),
            "rates": {name: real(f"rates: {name}", rate) for name, rate in self.rates.items()},
            "bounds": {name: _range(bound, name) for name, bound in self.bounds.items()},
            "implied": list(self.implied),
            "effort": [tuple(e) for e in self.effort],
            "moving": list(self.moving),
        }


def _listed(effort: Any) -> Tuple[Any, ...]:
    return (effort,) if isinstance(effort, str) else tuple(effort)


def _range(bound: Bound, name: str = "") -> Tuple[float, float]:
    try:
        lower, upper = bound
    except (TypeError, ValueError):
        raise _tiltrim.InvalidArgument(f"bounds: expected (lower, upper), got {bound!r}") from None
    what = f"bounds: {name}" if name else "bounds"
    return (
        -math.inf if lower is None else real(what, lower),
        math.inf if upper is None else real(what, upper),
    )


class TrimFields(TypedDict, total=False):
    """TrimSpec's arguments, as types of a verb's `**fields`."""

    free: Sequence[str]
    steady: Sequence[str]
    rates: Optional[Mapping[str, float]]
    bounds: Optional[Mapping[str, Bound]]
    implied: Sequence[str]
    effort: Sequence[Effort]
    moving: Sequence[str]
    still: Optional[Sequence[str]]


def shows_fields(verb: Verb) -> Verb:
    """Replaces `**fields` by TrimSpec's arguments in help() and inspect.signature()."""
    asked = inspect.signature(TrimSpec).parameters.values()
    own = inspect.signature(verb)
    shown = [p.replace(kind=p.KEYWORD_ONLY) for p in asked]
    shown += [p for p in own.parameters.values() if p.kind != p.VAR_KEYWORD]
    shown.sort(key=lambda p: p.kind)  # positional arguments first
    setattr(verb, "__signature__", own.replace(parameters=shown))
    return verb


def spec_of(verb: str, spec: Optional[TrimSpec], fields: TrimFields) -> TrimSpec:
    """The specification given to a verb, whole or as `**fields`; refuses unknown keywords."""
    for name in fields:
        if name not in TrimFields.__annotations__:
            raise TypeError(f"{verb}() got an unexpected keyword argument {name!r}")
    return spec or TrimSpec(**fields)


class Problem(Shown):
    """A trim problem: a model, what to solve for (see TrimSpec), and an initial guess.

    Several named problems are the operating points of a sweep or a tuning.
    """

    @shows_fields
    def __init__(
        self,
        model: Model,
        guess: Guess,
        *,
        name: str = "",
        spec: Optional[TrimSpec] = None,
        **fields: Unpack[TrimFields],
    ) -> None:
        self.spec = spec_of("Problem.__init__", spec, fields)._of(model)
        self.model = model
        self.guess = model.point(guess)
        self.name = name or model.name

    def _page(self) -> Page:
        notes = {name: "free" for name in self.spec.free}
        lines = [
            "steady: " + ", ".join(self.spec.steady) if self.spec.steady else "",
            "held: " + ", ".join(f"{n}' = {v:g}" for n, v in self.spec.rates.items())
            if self.spec.rates
            else "",
            *(
                f"{name} in [{lower:g}, {upper:g}]"
                for name, (lower, upper) in ((n, _range(b)) for n, b in self.spec.bounds.items())
            ),
        ]
        return Page(f"problem {self.name}", lines, [point_table(self.guess, notes)])
