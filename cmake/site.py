"""Hooks of mkdocs: how the repository's documents become a site (mkdocs.yml, make docs).

README.md is the first page, docs/index.md is chapters.md. The pages in reference/ are made by reference.py. Whatever else a page links to outside docs/ is put under
repository/. The sources keep the links and lists that GitHub understands; here they are brought into mkdocs' form.
"""

import json
import os
import re
import sys
from pathlib import Path

from mkdocs.structure.files import File

sys.path.insert(0, os.path.dirname(__file__))
from reference import PAGES  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"(?<=\]\()(?!https?:|mailto:|#)([^)\s#]+)")
NAMES = {"README.md": "index.md", "docs/index.md": "chapters.md", "cmake/site.css": "site.css"}


def on_config(config):
    config["mdx_configs"].setdefault("toc", {})["slugify"] = slug


def slug(heading, separator="-"):
    """The anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", separator)


def site_path(source):
    """Where a file of the repository is in the site, before mkdocs turns .md into .html."""
    inside = source[5:] if source.startswith("docs/") else f"repository/{source}"
    return NAMES.get(source, re.sub(r"\.ipynb$", ".md", inside))


def linked(source):
    """The files of the repository that a page links to."""
    for target in LINK.findall((ROOT / source).read_text(encoding="utf-8")):
        path = os.path.normpath(os.path.join(os.path.dirname(source), target))
        if (ROOT / path).is_file():
            yield path


def on_files(files, config):
    for file in [f for f in files if f.abs_src_path.startswith(config["docs_dir"])]:
        files.remove(file)
    pages = sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md"))
    found = [*NAMES, "CHANGELOG.md", *pages]
    for source in found:  # grows on the way
        if source.endswith(".md"):
            found += [path for path in linked(source) if path not in found]
    for source in dict.fromkeys(found):
        file = File(site_path(source), config["docs_dir"], config["site_dir"], config["use_directory_urls"])
        file.abs_src_path = str(ROOT / source)
        files.append(file)
    for source, (path, _) in PAGES.items():
        file = File(path, config["docs_dir"], config["site_dir"], config["use_directory_urls"])
        file.abs_src_path = str(ROOT / source)
        files.append(file)
    return files


def on_page_read_source(page, config):
    for path, text in PAGES.values():
        if page.file.src_path == path:
            return text(ROOT)
    if page.file.abs_src_path.endswith(".ipynb"):
        return notebook(json.loads(Path(page.file.abs_src_path).read_text(encoding="utf-8")))
    return None


def notebook(content):
    """A notebook as Markdown: its text, its code, what it printed."""
    parts = []
    for cell in content["cells"]:
        source = "".join(cell["source"])
        parts.append(f"```python\n{source}\n```" if cell["cell_type"] == "code" else source)
        for output in cell.get("outputs", []):
            parts.append("```text\n" + "".join(output.get("text", [])).rstrip("\n") + "\n```")
    return "\n\n".join(parts)


def on_page_markdown(markdown, page, config, files):
    if page.file.src_path.startswith("reference/"):
        return markdown  # with the links of the site
    source = os.path.relpath(page.file.abs_src_path, ROOT)

    def in_site(link):
        path = os.path.normpath(os.path.join(os.path.dirname(source), link[1]))
        return os.path.relpath(site_path(path), os.path.dirname(site_path(source)) or ".")

    return LINK.sub(in_site, indented(markdown))


def indented(markdown):
    """What belongs to a list item, by four columns, as Python-Markdown wants it, not by the width of its marker."""
    lines, width, fenced = [], 0, False
    for line in markdown.split("\n"):
        fenced ^= line.startswith("```")
        marker = None if fenced else re.match(r"(- |\d+\. )", line)
        if marker:
            width = len(marker[0])
        elif line and not line.startswith(" " * max(width, 1)):
            width = 0
        lines.append(" " * (4 - width) + line if width and line and not marker else line)
    return "\n".join(lines)


def on_page_content(html, page, config, files):
    html = html.replace("<table>", '<div class="scrolls"><table class="table table-sm">')
    return html.replace("</table>", "</table></div>")
