"""The Python blocks of README.md, docs/python.md, design.md, xv15.md and the tutorials print the output below them.

test_chapter.py --write updates the output in the documents.
"""

import contextlib
import io
import os
import re
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / "docs/tutorials").glob("*.md"))
BLOCK = re.compile(r"```python\n(.*?)```\n\n```text\n(.*?)```", re.DOTALL)
STUDY = re.compile(r"```toml\n(# (\S+\.toml)\n.*?)```", re.DOTALL)
ROUND_OFF = re.compile(r"-?\d(?:\.\d+)?e-1[2-9]\b|\b\de-\d\d\b")  # differs between compilers

DOCUMENTS = [ROOT / "README.md", ROOT / "docs/python.md", ROOT / "docs/design.md", ROOT / "docs/xv15.md"]
DOCUMENTS += [page for page in TUTORIALS if "```python" in page.read_text()]


def printed(code, document, namespace):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(code, str(document), "exec"), namespace)
    return re.sub(r" +$", "", out.getvalue(), flags=re.MULTILINE)


@contextlib.contextmanager
def studies_of_the_documents():
    """A working folder with the studies printed in the documents, from "# my.toml" on."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        for page in DOCUMENTS:
            for text, name in STUDY.findall(page.read_text()):
                Path(folder, name).write_text(text)
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def without_round_off(text):
    return ROUND_OFF.sub("#", text)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_python_blocks_print_what_stands_below_them(document):
    pytest.importorskip("xarray")
    text = document.read_text()
    blocks = BLOCK.findall(text)
    assert len(blocks) == text.count("```python") > 0
    namespace = {}
    with studies_of_the_documents():
        for code, expected in blocks:
            got = printed(code, document, namespace)
            assert without_round_off(got) == without_round_off(expected)


def test_no_document_is_missed():
    assert len(TUTORIALS) == 7 and len(DOCUMENTS) >= 7
    assert DOCUMENTS[0].read_text().count("```python") == 1


def rewritten(document):
    namespace = {}
    return BLOCK.sub(
        lambda m: f"```python\n{m[1]}```\n\n```text\n{printed(m[1], document, namespace)}```",
        document.read_text(),
    )


if __name__ == "__main__" and sys.argv[1:] == ["--write"]:
    with studies_of_the_documents():
        for path in DOCUMENTS:
            path.write_text(rewritten(path))
