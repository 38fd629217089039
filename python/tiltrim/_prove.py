"""prove: theorems over a box of a study's numbers."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple, Union, overload

from . import _tiltrim
from ._arguments import MOST_THREADS, real, whole
from ._progress import Progress, told
from ._show import Page, Shown, Table, number
from ._studies import Condition, StudyLike, study_of


@dataclass
class ProvedRegion:
    """A part of the box with one verdict; units of the study."""

    verdict: str  #: proved_stable, proved_unstable, proved_no_trim, undecided
    lower: Dict[str, float]
    upper: Dict[str, float]
    volume: float  #: share of the box
    cause: Optional[str]  #: of undecided


@dataclass(repr=False)
class Theorem(Shown):
    """What is proved of one condition over the whole box. True if all of it is stable or has no trim."""

    condition: str
    status: str  #: proved, partly, refuted
    margin: float  #: 1/s: every eigenvalue has a real part below -margin where proved stable
    damping: float  #: and a damping ratio above this; 0: any
    parameters: Dict[str, Tuple[float, float]]  #: the box, in units of the study
    boxes: int  #: examined
    stable: float  #: share of the volume; the next three too
    unstable: float
    no_trim: float
    undecided: float
    interrupted: bool
    regions: List[ProvedRegion]
    certificate: str  #: the evidence, for `tiltrim check-proof`; empty for a study with [model]

    def __bool__(self) -> bool:
        return self.status == "proved"

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the certificate, which `tiltrim check-proof` verifies. ValueError if there is none."""
        if not self.certificate:
            raise ValueError("a proof about [model] has no certificate")
        Path(path).write_text(self.certificate, encoding="utf-8")

    def _page(self) -> Page:
        box = ", ".join(f"{key} {low:.9g} to {high:.9g}" for key, (low, high) in self.parameters.items())
        rows = []
        for region in self.regions[:40]:
            where = ", ".join(f"{k} {region.lower[k]:.9g} to {region.upper[k]:.9g}" for k in region.lower)
            rows.append([region.verdict, region.cause or "", number(region.volume, 6), where])
        lines = [f"{self.boxes} boxes" + (", interrupted" if self.interrupted else "")]
        if len(self.regions) > len(rows):
            lines.append(f"{len(self.regions)} regions, the first {len(rows)}:")
        headings = ["verdict", "cause", "share", "where"]
        return Page(f"{self.status}: {self.condition}, {box}", lines, [Table(headings, rows, left=(0, 1, 3))])


def _theorem(raw: Dict[str, Any], certificate: str) -> Theorem:
    regions = [
        ProvedRegion(r["verdict"], r["from"], r["to"], r["volume"], r["cause"])
        for r in raw["regions"]
    ]
    box = {p["key"]: (p["from"], p["to"]) for p in raw["parameters"]}
    shares = {name: raw[f"proved_{name}"] for name in ("stable", "unstable", "no_trim")}
    known: Dict[str, Any] = {**raw, **shares, "parameters": box}
    known.update(regions=regions, certificate=certificate)
    return Theorem(**{field.name: known[field.name] for field in fields(Theorem)})


@overload
def prove(
    what: Condition,
    *,
    condition: None = None,
    margin: Optional[float] = None,
    damping: Optional[float] = None,
    boxes: Optional[int] = None,
    threads: int = 0,
    progress: Progress = None,
) -> Theorem: ...
@overload
def prove(
    what: StudyLike,
    *,
    condition: str,
    margin: Optional[float] = None,
    damping: Optional[float] = None,
    boxes: Optional[int] = None,
    threads: int = 0,
    progress: Progress = None,
) -> Theorem: ...
@overload
def prove(
    what: StudyLike,
    *,
    condition: None = None,
    margin: Optional[float] = None,
    damping: Optional[float] = None,
    boxes: Optional[int] = None,
    threads: int = 0,
    progress: Progress = None,
) -> Dict[str, Theorem]: ...
def prove(
    what: Union[StudyLike, Condition],
    *,
    condition: Optional[str] = None,
    margin: Optional[float] = None,
    damping: Optional[float] = None,
    boxes: Optional[int] = None,
    threads: int = 0,
    progress: Progress = None,
) -> Union[Theorem, Dict[str, Theorem]]:
    """Proves trim and stability for every value of the numbers of a study's [prove].

    what   : a Study or its path: {name: theorem}, or the one of condition=; or a Condition. Over h,
             which sets the command, the first condition stands for all
    margin : 1/s; default: the study's
    damping : damping ratio; default: the study's, or any
    boxes  : examined at most; default: the study's
    progress : True, or progress(done, total, text): returning False stops with what is proved

    docs/prove.md says what a theorem states and assumes.
    """
    single = condition is not None or isinstance(what, Condition)
    if isinstance(what, Condition):
        if condition is not None:
            raise TypeError("prove(): condition= names one of a study's conditions")
        condition = what.name
        what = what.study
    study = study_of("prove", what)
    if condition is not None:
        study[condition]  # names those that there are
    if margin is not None and not 0 <= real("margin", margin) <= 1000:
        raise _tiltrim.InvalidArgument(f"margin: {margin}; expected 0 to 1000 1/s")
    if damping is not None and not 0 <= real("damping", damping) <= 0.99:
        raise _tiltrim.InvalidArgument(f"damping: {damping}; expected 0 to 0.99")
    threads = whole("threads", threads, MOST_THREADS)
    if boxes is not None and boxes < 1:
        raise _tiltrim.InvalidArgument(f"boxes: {boxes}; expected at least 1")
    only = [] if condition is None else [condition]
    with told(progress) as tell:
        text, certificates = _tiltrim.prove(study._core, only, margin, damping, boxes, threads, tell)
    theorems = [_theorem(r, c) for r, c in zip(json.loads(text)["theorems"], certificates)]
    return theorems[0] if single else {t.condition: t for t in theorems}
