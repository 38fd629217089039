"""report: everything about a study on one page."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Sequence, Union

from . import _tiltrim
from ._arguments import MOST_THREADS, whole
from ._show import Page, Shown
from ._studies import StudyLike, study_of

Path = Union[str, "os.PathLike[str]"]


@dataclass(repr=False)
class Report(Shown):
    """A report's page. True if every analysis has an answer."""

    file: str  #: the page, HTML that needs nothing else
    summary: str  #: the verdict, and what has no answer and why
    answered: bool

    def __bool__(self) -> bool:
        return self.answered

    def _page(self) -> Page:
        words = [line.strip() for line in self.summary.splitlines()]
        return Page(f"report: {self.file}", words)


def report(
    study: StudyLike,
    file: Path,
    *,
    only: Sequence[str] = (),
    maps: Sequence[Path] = (),
    figures: Path = "",
    tables: Path = "",
    threads: int = 0,
) -> Report:
    """Writes a study's page as `tiltrim report` does: trims, modes, margins, maps, flight, tables.

    study   : a Study or its path
    file    : the page, HTML; a complete file or none
    only    : conditions; default: all
    maps    : files of save() or `tiltrim sweep`, used instead of computing them
    figures, tables : folders for the figures and tables as files
    threads : of the maps; 0: as many as the machine has

    Needs the program gnuplot. On a terminal, progress is shown on standard error (docs/report.md).
    """
    study = study_of("report", study)
    for name in only:
        study[name]  # raises, with the names there are
    page, maps_ = os.fspath(file), [os.fspath(one) for one in maps]
    threads = whole("threads", threads, MOST_THREADS)
    text, answered = _tiltrim.report(
        study._core, page, list(only), maps_, os.fspath(figures), os.fspath(tables), threads
    )
    return Report(page, text[: text.rindex(page)].rstrip(), answered)
