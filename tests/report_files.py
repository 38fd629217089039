#!/usr/bin/env python3
"""Compares the files of `tiltrim report` with its page: report_files.py PROGRAM SOURCE_FOLDER

The tables of the page, of CSV and of LaTeX are the same tables with the same numbers at printed
precision; every figure is there as SVG, PDF and PNG of a column's width. Exit code 0: all as
expected; 1: not; 77: no gnuplot (skipped).
"""

import csv
import html.parser
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

sys.dont_write_bytecode = True
from packages import skip  # noqa: E402

NOTHING = "–"
COLUMN = 88.0  # mm


# ---- The page ------------------------------------------------------------------------------------

class Tables(html.parser.HTMLParser):
    """The page's tables by name: keys of the columns and rows of (text, is a number's column)."""

    def __init__(self):
        super().__init__()
        self.tables, self.name, self.cell, self.number = {}, None, None, False

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if "data-table" in given:
            self.name = given["data-table"]
            self.tables[self.name] = ([], [])
        elif self.name and tag == "tr":
            self.tables[self.name][1].append([])
        elif self.name and tag in ("td", "th"):
            if "data-key" in given:
                self.tables[self.name][0].append(given["data-key"])
            self.cell, self.number = "", "number" in given.get("class", "").split()

    def handle_data(self, text):
        if self.cell is not None:
            self.cell += text

    def handle_endtag(self, tag):
        if self.cell is not None and tag in ("td", "th"):
            self.tables[self.name][1][-1].append((self.cell, self.number))
            self.cell = None
        elif tag == "table":
            self.tables[self.name][1].pop(0)  # the heads
            self.name = None


def tables_of(page):
    reader = Tables()
    reader.feed(page)
    return reader.tables


# ---- The same in files ---------------------------------------------------------------------------

def number(text):
    try:
        return float(text)
    except ValueError:
        return None


def last_digit(shown):
    """Of "-12.50e-3" the last digit counts 1e-5."""
    mantissa, _, exponent = shown.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def printed_as(shown, value):
    """Is the number `shown` the number `value`, rounded?"""
    if shown in ("inf", "-inf", "nan") or value in ("inf", "-inf", "nan"):
        return shown == value
    return abs(float(shown) - float(value)) <= 0.5 * last_digit(shown) + 1e-12 * abs(float(value))


def letters(text):
    """The letters of LaTeX text without commands and marks."""
    return re.sub(r"[^A-Za-z0-9]", "", re.sub(r"\\(?:char\d+|[A-Za-z]+)", "", text))


def latin(text):
    """The same for plain text."""
    return re.sub(r"[^A-Za-z0-9]", "", text.replace("²", "2").replace("³", "3"))


def rows_of_csv(file):
    with open(file, newline="", encoding="utf-8") as lines:
        keys, *rows = csv.reader(lines)
    return keys, rows


def rows_of_latex(file):
    bodies = re.findall(r"\\midrule\n(.*?)\\bottomrule", file.read_text(encoding="utf-8"), re.DOTALL)
    return [line.split(" & ") for body in bodies for line in body.replace(" \\\\\n", "\n").splitlines()]


def compare_csv(name, keys, rows, file):
    csv_keys, csv_rows = rows_of_csv(file)
    if csv_keys != keys or [len(r) for r in csv_rows] != [len(r) for r in rows]:
        yield f"{name}: the CSV has other columns or rows"
        return
    for shown, given in zip(rows, csv_rows):
        for key, (text, is_number), value in zip(keys, shown, given):
            if value == "" and text == NOTHING:
                continue
            same = printed_as(text, value) if is_number and number(text) is not None else text.strip() == value.strip()
            if not same:
                yield f"{name}, {key}: \"{text}\" on the page, \"{value}\" in CSV"


def compare_latex(name, keys, rows, file):
    latex = rows_of_latex(file)
    if [len(r) for r in latex] != [len(r) for r in rows]:
        yield f"{name}: the LaTeX has other columns or rows"
        return
    for shown, given in zip(rows, latex):
        for key, (text, is_number), value in zip(keys, shown, given):
            if text == NOTHING:
                same = value in ("{--}", "--")
            elif is_number and number(text) is not None and number(value) is not None:
                same = float(text) == float(value) and last_digit(text) == last_digit(value)
            else:
                same = latin(text) == letters(value)
            if not same:
                yield f"{name}, {key}: \"{text}\" on the page, \"{value}\" in LaTeX"


def misses_of_tables(page, folder):
    tables = tables_of(page)
    for ending in ("txt", "csv", "md", "tex"):
        files = {file.stem for file in folder.glob(f"*.{ending}")}
        if files != set(tables):
            yield f"only on the page or only as {ending}: {sorted(files ^ set(tables))}"
    if sum(is_number for _, rows in tables.values() for row in rows for _, is_number in row) < 200:
        yield "the page has hardly a number"
    for name, (keys, rows) in tables.items():
        yield from compare_csv(name, keys, rows, folder / f"{name}.csv")
        yield from compare_latex(name, keys, rows, folder / f"{name}.tex")


# ---- Figures -------------------------------------------------------------------------------------

def misses_of_svg(file):
    root = xml.etree.ElementTree.parse(file).getroot()
    if root.tag != "{http://www.w3.org/2000/svg}svg" or sum(e.tag.endswith("}path") for e in root.iter()) < 3:
        yield f"{file.name}: nothing is drawn"


def misses_of_pdf(file):
    text = file.read_bytes()
    boxes = re.findall(rb"/MediaBox\s*\[\s*0\s+0\s+([\d.]+)\s+([\d.]+)\s*\]", text)
    if not text.startswith(b"%PDF-") or len(boxes) != 1:
        yield f"{file.name}: {len(boxes)} pages"
        return
    width = float(boxes[0][0]) * 25.4 / 72
    if abs(width - COLUMN) > 25.4 / 72:  # whole points
        yield f"{file.name}: {width:.2f} mm wide"


def misses_of_png(file):
    text = file.read_bytes()
    if text[:8] != b"\x89PNG\r\n\x1a\n" or text[12:16] != b"IHDR":
        yield f"{file.name}: no PNG"
        return
    width = struct.unpack(">I", text[16:20])[0] * 25.4 / 300
    if abs(width - COLUMN) > 0.2:
        yield f"{file.name}: {width:.2f} mm wide at 300 dots per inch"


def misses_of_figures(page, folder):
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)[1])
    names = {figure["name"] for figure in data["figures"]}
    for ending, misses in (("svg", misses_of_svg), ("pdf", misses_of_pdf), ("png", misses_of_png)):
        files = {file.stem: file for file in folder.glob(f"*.{ending}")}
        if set(files) != names:
            yield f"only on the page or only as {ending}: {sorted(set(files) ^ names)}"
        for file in files.values():
            yield from misses(file)


def main():
    if not shutil.which("gnuplot"):
        skip("gnuplot")
    program, source = sys.argv[1], pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([program, "report", source / "studies/paper.toml", "-o", folder / "paper.html",
                        "--tables", folder / "tables", "--figures", folder / "figures"],
                       check=True, stdout=subprocess.DEVNULL)
        page = (folder / "paper.html").read_text(encoding="utf-8")
        missed = [*misses_of_tables(page, folder / "tables"), *misses_of_figures(page, folder / "figures")]
    print("\n".join(missed) or "tables and figures are as expected")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
