"""Progress of long verbs: a callable, a bar of tqdm, or a line on standard error."""

from __future__ import annotations

import contextlib
import importlib.util
import sys
from typing import Any, Callable, Iterator, Optional, Union

#: progress(done, total, text); an exception ends the verb, False stops it with what it has
Tell = Callable[[int, int, str], Any]
#: True: a bar of tqdm if it is installed, else a line on standard error
Progress = Union[None, bool, Tell]


class _Bar:
    """One bar of tqdm for each stage, the text before a colon."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._stage = ""

    def __call__(self, done: int, total: int, text: str) -> None:
        stage, _, rest = text.partition(": ")
        if self._bar is None or stage != self._stage or total != self._bar.total:
            self.close()
            self._bar = importlib.import_module("tqdm.auto").tqdm(total=total, desc=stage)
            self._stage = stage
        self._bar.n = done
        self._bar.set_postfix_str(rest)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
        self._bar = None


class _Line:
    def __init__(self) -> None:
        self._width = 0

    def __call__(self, done: int, total: int, text: str) -> None:
        line = f"{done} of {total} {text}"
        sys.stderr.write("\r" + line.ljust(self._width))
        sys.stderr.flush()
        self._width = len(line)

    def close(self) -> None:
        if self._width:
            sys.stderr.write("\n")


@contextlib.contextmanager
def told(progress: Progress) -> Iterator[Optional[Tell]]:
    """The callable for a verb's progress=; what is drawn is closed in the end."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        shown: Union[_Bar, _Line] = _Bar() if importlib.util.find_spec("tqdm") else _Line()
        try:
            yield shown
        finally:
            shown.close()
    elif callable(progress):
        yield progress
    else:
        raise TypeError(f"progress: expected True or progress(done, total, text), got {progress!r}")
