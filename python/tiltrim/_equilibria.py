"""all_equilibria: every equilibrium of a problem that starts and branches lead to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Optional, Sequence, Tuple, Union

from . import _tiltrim
from ._linear import Modes, _modes
from ._models import Model
from ._problems import Guess, Problem, TrimFields, TrimSpec, shows_fields, spec_of
from ._show import Page, Plotted, Shown, Table, number
from ._studies import Condition, of_studies
from ._trim import TrimResult, _result, asked, time_limited

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(repr=False)
class Equilibrium(Shown):
    """An equilibrium, and how it was found."""

    trim: TrimResult
    found: str  #: "a start", or "the branch in V"
    modes: Optional[Modes]  #: None without a linear model

    def __getitem__(self, name: str) -> float:
        return self.trim[name]

    def _page(self) -> Page:
        page = self.trim._page()
        verdict = "no linear model" if self.modes is None else self.modes.verdict
        return Page(f"{verdict}, from {self.found}", page.lines, page.tables)


@dataclass(repr=False)
class AllEquilibria(Plotted):
    """The equilibria found, by increasing cost: equilibria[0]["theta"]. That there are no others is
    not proved. True if there are any."""

    equilibria: List[Equilibrium]
    none: Optional[TrimResult]  #: the trim that found none, with its message
    starts: int  #: Newton starts over the limits
    branches: int  #: followed from the equilibria, to see where they return
    exception: Optional[BaseException] = None

    def __len__(self) -> int:
        return len(self.equilibria)

    def __getitem__(self, number: int) -> Equilibrium:
        return self.equilibria[number]

    def __iter__(self) -> Iterator[Equilibrium]:
        return iter(self.equilibria)

    def _page(self) -> Page:
        one = len(self) == 1
        heading = f"{len(self)} equilibri{'um' if one else 'a'} from {self.starts} "
        heading += f"start{'' if self.starts == 1 else 's'} and {self.branches} branches"
        if not self.equilibria:
            return Page(heading, [self.none.message] if self.none else [])
        states = self.equilibria[0].trim.model.states
        rows = [
            [
                str(i + 1),
                *(number(float(x)) for x in e.trim.point.x),
                "" if e.modes is None else e.modes.verdict,
                e.found,
            ]
            for i, e in enumerate(self.equilibria)
        ]
        headings = ["", *(s.name for s in states), "verdict", "found by"]
        units = ["", *(s.unit for s in states), "", ""]
        left = (len(headings) - 2, len(headings) - 1)
        return Page(heading, [], [Table(headings, rows, units, left=left)])


@of_studies
@shows_fields
def all_equilibria(
    what: Union[Model, Problem, Condition, TrimResult],
    guess: Optional[Guess] = None,
    *,
    parameters: Sequence[str] = (),
    reach: float = 10.0,
    starts: int = 200,
    method: str = "ipopt",
    time_limit: Optional[float] = None,
    spec: Optional[TrimSpec] = None,
    **fields: Unpack[TrimFields],
) -> AllEquilibria:
    """All equilibria within the limits: Newton from many starts, then branches from each of them.

    what   : a Model with a guess and a trim specification, a Problem or a TrimResult; a Condition,
             with branches in V, gamma and eta where it fixes them; or a Study or its path:
             {name: equilibria}, or those of condition=
    parameters, reach : not of a Condition: variables that the trim does not solve for; a branch in
             each, up to `reach` nominal sizes away, that returns to its value gives another
             equilibrium
    starts, method, time_limit : as of trim()

    That the list is complete is not proved. Raises ValueError for unknown names.
    """
    own = spec_of("all_equilibria", spec, fields)
    options = {"starts": starts, "method": method, **time_limited(time_limit)}
    if isinstance(what, Condition):
        if parameters:
            raise TypeError("all_equilibria() of a Condition: its branches are in V, gamma and eta")
        raw = _tiltrim.all_equilibria_condition(what._core, options)
        return _all(raw, what.model, what.spec)
    model, own, at = asked(what, guess, own, "all_equilibria")
    raw = _tiltrim.all_equilibria(
        model._core, own._fields(), at._tuple(), list(parameters), float(reach), options
    )
    return _all(raw, model, own)


def _all(raw: Dict[str, Any], model: Model, spec: TrimSpec) -> AllEquilibria:
    names: Tuple[str, ...] = tuple(s.name for s in model.states)

    def trimmed(fields: Dict[str, Any]) -> TrimResult:
        return _result({"moment": None, "exception": None, **fields}, model, spec)

    equilibria = [
        Equilibrium(trimmed(fields), found, _modes(modes, names) if modes else None)
        for fields, found, modes in raw["equilibria"]
    ]
    none = trimmed(raw["none"]) if raw["none"] else None
    return AllEquilibria(equilibria, none, raw["starts"], raw["branches"], raw["exception"])
