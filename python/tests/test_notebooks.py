"""The notebooks run from the first cell to the last and reproduce their stored output. They run
without Jupyter.

test_notebooks.py --write stores the output.
"""

import contextlib
import io
import json
import os
import sys
from pathlib import Path

import pytest
from test_chapter import ROOT, without_round_off

NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))
os.environ["MPLBACKEND"] = "Agg"  # figures go nowhere


def code_cells(notebook):
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def stored(cell):
    return "".join(line for output in cell["outputs"] for line in output["text"])


def run(notebook, path):
    """Output of each code cell, all run in one namespace."""
    namespace = {}
    for cell in code_cells(notebook):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile("".join(cell["source"]), path.name, "exec"), namespace)
        yield out.getvalue()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_prints_what_is_stored(path):
    pytest.importorskip("xarray")
    notebook = json.loads(path.read_text(encoding="utf-8"))
    for cell, printed in zip(code_cells(notebook), run(notebook, path)):
        if "matplotlib" not in "".join(cell["source"]):
            assert without_round_off(printed) == without_round_off(stored(cell))


def test_there_are_notebooks_and_they_are_small():
    assert len(NOTEBOOKS) == 3
    assert all(path.stat().st_size < 20_000 for path in NOTEBOOKS)


def write(path):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    for number, (cell, printed) in enumerate(zip(code_cells(notebook), run(notebook, path)), 1):
        lines = printed.splitlines(keepends=True)
        text = {"name": "stdout", "output_type": "stream", "text": lines}
        keep = printed and "matplotlib" not in "".join(cell["source"])
        cell.update(execution_count=number, outputs=[text] if keep else [])
    path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__" and sys.argv[1:] == ["--write"]:
    for each in NOTEBOOKS:
        write(each)
