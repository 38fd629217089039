"""docs/python.md is run as it stands, and prints what it says; so is README.md's Python.

test_chapter.py --write puts what is printed into it.
"""

import contextlib
import io
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CHAPTER = ROOT / "docs/python.md"
BLOCK = re.compile(r"```python\n(.*?)```\n\n```text\n(.*?)```", re.DOTALL)


def printed(code, namespace):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(code, str(CHAPTER), "exec"), namespace)
    return re.sub(r" +$", "", out.getvalue(), flags=re.MULTILINE)


def test_the_chapter_prints_what_it_says():
    import pytest

    pytest.importorskip("xarray")
    text = CHAPTER.read_text()
    assert len(BLOCK.findall(text)) == text.count("```python") > 5
    namespace = {}
    for code, expected in BLOCK.findall(text):
        assert printed(code, namespace) == expected


def test_the_readme_prints_what_it_says():
    blocks = BLOCK.findall((ROOT / "README.md").read_text())
    assert len(blocks) == 1
    assert printed(blocks[0][0], {}) == blocks[0][1]


if __name__ == "__main__" and sys.argv[1:] == ["--write"]:
    shared = {}
    CHAPTER.write_text(
        BLOCK.sub(
            lambda m: f"```python\n{m[1]}```\n\n```text\n{printed(m[1], shared)}```",
            CHAPTER.read_text(),
        )
    )
