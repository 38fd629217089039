#!/usr/bin/env python3
"""Every relative link and anchor of the repository's Markdown has a target, in the sources and in the site that
mkdocs makes of them; the site's reference has every key of a study and every public name of the Python package:
docs_site.py SOURCE_FOLDER

Exit code 0: they do; 1: not; 77: the sources' do, and there is no mkdocs (Debian: mkdocs) to make the site.
"""

import collections
import html.parser
import importlib.util
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.parse

sys.dont_write_bytecode = True
from packages import skip  # noqa: E402

LINK = re.compile(r"\]\(([^)\s]+)\)|^\[[^\]]+\]: (\S+)", re.MULTILINE)
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
ELSEWHERE = re.compile(r"[a-z]+:")


def documents(root):
    """All Markdown of the repository except built and installed files."""
    for folder, inner, files in os.walk(root):
        inner[:] = [d for d in inner if not d.startswith((".", "build", "env", "venv", "node_modules"))]
        yield from (pathlib.Path(folder, name) for name in files if name.endswith(".md"))


def anchors(text):
    """The anchors that GitHub makes of the headings."""
    found = collections.Counter()
    for heading in re.findall(r"^#+ +(.*)$", FENCED.sub("", text), re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
        slug = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        found[slug] += 1
        found[f"{slug}-{found[slug] - 1}"] += found[slug] > 1
    return {slug for slug, times in found.items() if times}


def broken_in_sources(root):
    for page in sorted(documents(root)):
        text = page.read_text(encoding="utf-8")
        for found in LINK.finditer(FENCED.sub("", text)):
            target = found[1] or found[2]
            if ELSEWHERE.match(target):
                continue
            path, _, anchor = target.partition("#")
            file = page.parent / urllib.parse.unquote(path) if path else page
            if not file.exists():
                yield f"{page.relative_to(root)}: no file {target}"
            elif anchor and file.suffix == ".md" and anchor not in anchors(file.read_text(encoding="utf-8")):
                yield f"{page.relative_to(root)}: no heading {target}"


class Page(html.parser.HTMLParser):
    """The ids of a page, and its references."""

    def __init__(self, file):
        super().__init__()
        self.ids, self.links, self.loaded = set(), [], []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids.add(given.get("id"))
        target = given.get("src") or given.get("href")
        if target:
            (self.links if tag == "a" else self.loaded).append(target)


def broken_in_site(site):
    pages = {file: Page(file) for file in sorted(site.rglob("*.html")) if file.name != "404.html"}
    for file, page in pages.items():
        yield from (f"{file.name}: loads {target}" for target in page.loaded if ELSEWHERE.match(target))
        for target in page.links + page.loaded:
            path, _, anchor = target.partition("#")
            if ELSEWHERE.match(target) or target.startswith("//"):
                continue
            to = pathlib.Path(os.path.normpath(file.parent / urllib.parse.unquote(path))) if path else file
            if not to.exists():
                yield f"{file.relative_to(site)}: no file {target}"
            elif anchor and to in pages and urllib.parse.unquote(anchor) not in pages[to].ids:
                yield f"{file.relative_to(site)}: no anchor {target}"


def keys_of(schema):
    """Every key that a schema names."""
    if isinstance(schema, dict):
        if schema.get("type") == "object":
            yield from schema.get("properties", ())
        for part in schema.values():
            yield from keys_of(part)
    elif isinstance(schema, list):
        for part in schema:
            yield from keys_of(part)


def properties_of(schema):
    """The keys of a schema of JSON."""
    for name, value in schema.get("properties", {}).items():
        yield name
        yield from properties_of(value)
    for part in ("items", "additionalProperties"):
        if part in schema:
            yield from properties_of(schema[part])


def missing_in_reference(root, site):
    """Keys of studies and of JSON, and public names of the Python package that their pages do not have."""
    schema = json.loads((root / "data/study.schema.json").read_text(encoding="utf-8"))
    text = (site / "reference/study-keys.html").read_text(encoding="utf-8")
    yield from (f"study-keys: no {key}" for key in sorted(set(keys_of(schema))) if f"<code>{key}</code>" not in text)
    printed = json.loads((root / "data/output.schema.json").read_text(encoding="utf-8"))["definitions"]
    text = (site / "reference/json-keys.html").read_text(encoding="utf-8")
    yield from (f"json-keys: no {command}" for command in printed if f">{command}</h2>" not in text)
    keys = {key for schema in printed.values() for key in properties_of(schema)}
    yield from (f"json-keys: no {key}" for key in sorted(keys) if not re.search(rf"<code>([^<]*\.)?{key}(\[\])*</code>", text))
    listed = re.findall(r'^    "(\w+)",$', (root / "python/tiltrim/__init__.py").read_text(), re.MULTILINE)
    text = (site / "reference/python-names.html").read_text(encoding="utf-8")
    yield from (f"python-names: no {name}" for name in listed if not re.search(rf"<h2 id=\"\w+\">{name}</h2>", text))
    if len(listed) < 50 or "all_equilibria(" not in text or "Raises ValueError" not in text:
        yield "python-names: no names, signatures or docstrings"


def finish(complaints):
    if complaints:
        sys.exit("\n".join(complaints))


def main(root):
    finish(list(broken_in_sources(root)))
    if not importlib.util.find_spec("mkdocs"):
        skip("mkdocs")
    with tempfile.TemporaryDirectory() as folder:
        site = pathlib.Path(folder, "site")
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(site)]
        made = subprocess.run(command, cwd=root, capture_output=True, text=True,
                              env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})
        finish([made.stdout + made.stderr] if made.returncode else [])
        finish([*broken_in_site(site), *missing_in_reference(root, site)])
        print(len(list(site.rglob("*.html"))), "pages")


main(pathlib.Path(sys.argv[1]).resolve())
