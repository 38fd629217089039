"""Numbers, names and dictionaries among the arguments of the verbs."""

from __future__ import annotations

import operator
from typing import Any, Dict, Mapping, Sequence, Tuple

from . import _tiltrim

#: as the program's --threads
MOST_THREADS = 1024


def real(what: str, value: Any) -> float:
    """The number given for `what`. float() alone would take a text."""
    try:
        if not isinstance(value, (str, bytes)):
            return float(value)
    except (TypeError, ValueError):
        pass
    raise TypeError(f"{what}: expected a number, got {value!r}") from None


def whole(what: str, value: Any, most: int) -> int:
    """The whole number from 0 to `most` given for `what`."""
    number = operator.index(value) if hasattr(value, "__index__") else -1
    if not 0 <= number <= most:
        raise _tiltrim.InvalidArgument(
            f"{what}: expected a whole number from 0 to {most}, got {value!r}"
        )
    return number


def pair(what: str, given: Any) -> Tuple[float, float]:
    """The two numbers given for `what`."""
    try:
        lower, upper = given
    except (TypeError, ValueError):
        raise TypeError(f"{what}: expected (lower, upper), got {given!r}") from None
    return real(what, lower), real(what, upper)


def mapping(what: str, given: Any, entry: str) -> Dict[str, Any]:
    """The dictionary given for `what`, None for an empty one."""
    if given is not None and not isinstance(given, Mapping):
        raise TypeError(f"{what}: expected {entry}, got {given!r}")
    return dict(given or {})


def listed_names(what: str, given: Sequence[str]) -> Tuple[str, ...]:
    """The names given for `what`: a text alone would be a list of its letters."""
    if isinstance(given, str):
        raise TypeError(f"{what}: expected a list of names, got the string {given!r}")
    return tuple(given)
