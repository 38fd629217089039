"""Results on a terminal and in a notebook: one description, rendered as text or HTML."""

from __future__ import annotations

import html
from dataclasses import dataclass, field
from typing import Any, List, Sequence


def number(value: float, digits: int = 6) -> str:
    """A number with `digits` significant digits; integers without a decimal point."""
    return f"{value:.{digits}g}"


def fixed(value: float, decimals: int) -> str:
    """A number to so many decimals; one with more than ten digits before its point as 1e+300."""
    return f"{value:.{decimals}f}" if abs(value) < 1e10 else f"{value:.7g}"


@dataclass
class Table:
    """Columns with heading and unit (either may be empty), and rows with one cell per column."""

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    units: Sequence[str] = ()
    left: Sequence[int] = ()  #: indices of text columns

    def text(self) -> str:
        heads = [list(self.headings)]
        if any(self.units):
            heads.append(list(self.units))
        lines = heads + [list(row) for row in self.rows]
        widths = [max(len(line[i]) for line in lines) for i in range(len(self.headings))]

        def cell(i: int, words: str) -> str:
            return words.ljust(widths[i]) if i in self.left else words.rjust(widths[i])

        return "\n".join(
            "  " + "  ".join(cell(i, words) for i, words in enumerate(line)).rstrip()
            for line in lines
        )

    def html(self) -> str:
        def row(cells: Sequence[str], tag: str) -> str:
            inner = "".join(
                f'<{tag} style="text-align:{"left" if i in self.left else "right"}">'
                f"{html.escape(words)}</{tag}>"
                for i, words in enumerate(cells)
            )
            return f"<tr>{inner}</tr>"

        heads = [
            f"{name} [{unit}]" if unit else name
            for name, unit in zip(self.headings, self.units or [""] * len(self.headings))
        ]
        body = "".join(row(cells, "td") for cells in self.rows)
        return f"<table><thead>{row(heads, 'th')}</thead><tbody>{body}</tbody></table>"


@dataclass
class Page:
    """A heading, lines of text and tables."""

    heading: str
    lines: List[str] = field(default_factory=list)
    tables: List[Table] = field(default_factory=list)

    def text(self) -> str:
        parts = [self.heading] + ["  " + line for line in self.lines if line]
        parts += [table.text() for table in self.tables if table.rows]
        return "\n".join(parts)

    def html(self) -> str:
        parts = [f"<b>{html.escape(self.heading)}</b>"]
        parts += [f"<div>{html.escape(line)}</div>" for line in self.lines if line]
        parts += [table.html() for table in self.tables if table.rows]
        return "<div>" + "".join(parts) + "</div>"


class Shown:
    """Base of results that have a page: text in repr(), HTML in a notebook."""

    def _page(self) -> Page:
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._page().text()

    def _repr_html_(self) -> str:
        return self._page().html()


class Plotted(Shown):
    """A result with a picture."""

    def plot(self, *names: str, axes: Any = None) -> Any:
        """Draws the result with matplotlib and returns the axes: see tiltrim.plot()."""
        from ._plot import plot

        return plot(self, *names, axes=axes)
