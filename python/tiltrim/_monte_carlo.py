"""monte_carlo: a study's flight with scattered parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List

from . import _tiltrim
from ._arguments import MOST_THREADS, whole
from ._needs import need
from ._progress import Progress, told
from ._show import Page, Shown, Table, number
from ._studies import StudyLike, study_of


@dataclass(repr=False)
class ScatteredFlight(Shown):
    """One of the worst flights; fly(study, number=flight.number) flies it again."""

    number: int  #: from 0 on
    status: str  #: as of a Flight
    good: bool  #: within the tolerances of [montecarlo]
    t: float  #: at the end, s
    height: float  #: at the end, m
    V_off: float  #: from the last command, m/s
    gamma_off: float  #: rad
    theta_most: float  #: largest |theta|, rad
    miss: float  #: largest deviation over its tolerance
    scattered: Dict[str, float]  #: the parameters, in the study's units

    def _page(self) -> Page:
        values = ", ".join(f"{name} = {number(v)}" for name, v in self.scattered.items())
        return Page(f"flight {self.number}: {self.status}, misses by {number(self.miss, 4)}", [values])


@dataclass(repr=False)
class MonteCarlo(Shown):
    """The share of good flights, with its confidence interval of 95 %. True if all were flown."""

    asked: int
    flown: int
    good: int
    share: float  #: good / flown
    lower: float  #: Clopper-Pearson
    upper: float
    ends: Dict[str, int]  #: number of flights by status
    worst: List[ScatteredFlight]
    message: str  #: why none was possible
    interrupted: bool  #: progress returned False

    def __bool__(self) -> bool:
        return not self.interrupted and not self.message

    def to_dataframe(self) -> Any:
        """A pandas.DataFrame of the worst flights; needs pandas."""
        pd = need("pandas", "pandas", "to_dataframe()")
        rows = [{**vars(one), **one.scattered} for one in self.worst]
        return pd.DataFrame(rows).drop(columns="scattered", errors="ignore")

    def _page(self) -> Page:
        heading = f"{self.good} of {self.flown} flights good: {100 * self.share:.1f} %"
        interval = f"between {100 * self.lower:.1f} and {100 * self.upper:.1f} % (95 %)"
        rows = [
            [str(one.number), one.status, number(one.miss, 4), number(one.t, 4)]
            for one in self.worst
        ]
        headings = ["worst", "status", "miss", "end"]
        table = Table(headings, rows, ["", "", "", "s"], left=(1,))
        return Page(heading, [interval, self.message], [table])


def monte_carlo(study: StudyLike, *, threads: int = 0, progress: Progress = None) -> MonteCarlo:
    """The flights of a study's [montecarlo], as `tiltrim simulate --monte-carlo`.

    study    : a Study or its path
    threads  : 0: as many as the machine has; the result does not depend on it
    progress : True, or progress(done, total, text): returning False stops with the flights so far
    """
    study = study_of("monte_carlo", study)
    with told(progress) as tell:
        raw = _tiltrim.monte_carlo(study._core, whole("threads", threads, MOST_THREADS), tell)
    names = raw.pop("names")
    worst = []
    for *outcome, values in raw.pop("worst"):
        worst.append(ScatteredFlight(*outcome, dict(zip(names, values))))  # type: ignore[call-arg]
    return MonteCarlo(worst=worst, **raw)
