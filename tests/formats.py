#!/usr/bin/env python3
"""Runs the program on a study and compares Markdown and LaTeX with CSV: formats.py PROGRAM STUDY

Every number in either must be the CSV's number, rounded to the printed digits. LaTeX must keep
its rules (braces, environments, as many cells as columns, commands that exist); where pdflatex is
installed, it must compile without a warning. Exit code 0: all as expected; 1: not.
"""

import csv
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
from packages import leave_out  # noqa: E402

PACKAGES = "amsmath,array,booktabs,graphicx,siunitx"
# Commands a table may use: LaTeX's and those of the packages above.
COMMANDS = set(
    """begin end centering caption footnotesize setlength tabcolsep resizebox ifdim width textwidth else fi toprule midrule
    bottomrule cmidrule multicolumn raggedright arraybackslash par medskip paragraph unit degree metre per second radian
    decibel percent squared cubed kilogram newton textbackslash textasciicircum textasciitilde textless textgreater textbar
    char textsuperscript textsubscript circ pm tfrac cdot times leq geq infty rightarrow mathrm dots alpha gamma delta eta
    theta zeta lambda omega phi rho sigma varepsilon pi surd""".split()
)

faults = []


def expect(condition, words):
    if not condition:
        faults.append(words)


def printed(program, command, study, form):
    run = subprocess.run([program, command, study, "--format", form], capture_output=True, text=True, check=False)
    expect(run.returncode in (0, 1) and run.stdout, f"{command} --format {form}: exit code {run.returncode}: {run.stderr}")
    return run.stdout


def shows(text, number):
    """Is the text that number, rounded to the digits it has? A tie may go either way."""
    if not number or text in ("–", "-", "--"):
        return not number
    if text in ("inf", "-inf"):
        return float(number) == float(text)
    digits, _, exponent = text.partition("e")
    decimals = len(digits.partition(".")[2])
    last = 10.0 ** (int(exponent or 0) - decimals)
    return abs(float(text) - float(number)) <= 0.5 * last * (1 + 1e-9)


# ---- Markdown ----------------------------------------------------------------------------------


def markdown_tables(text):
    """(title, rows of cells) of each table; the first row is the head."""
    tables, title = [], ""
    for line in text.splitlines():
        if line.startswith("**"):
            title = line.strip("*")
        elif line.startswith("|"):
            cells = [c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]]
            if not tables or tables[-1][0] != title:
                tables.append((title, []))
            tables[-1][1].append(cells)
    for title, rows in tables:
        expect(len({len(r) for r in rows}) == 1, f"Markdown: '{title}': rows of different length")
        expect(all(re.fullmatch(":?-+:?", c) for c in rows[1]), f"Markdown: '{title}': no rule below the head")
        del rows[1]
    return tables


# ---- LaTeX -------------------------------------------------------------------------------------


def check_latex(text):
    body = re.sub(r"(?<!\\)%.*", "", text)
    depth = 0
    for token in re.findall(r"\\.|[{}]", body):
        depth += {"{": 1, "}": -1}.get(token, 0)
        expect(depth >= 0, "LaTeX: a brace is closed that is not open")
    expect(depth == 0, "LaTeX: a brace is left open")
    open_ones = []
    for what, name in re.findall(r"\\(begin|end)\{([a-z*]+)\}", body):
        if what == "begin":
            open_ones.append(name)
        else:
            expect(open_ones and open_ones.pop() == name, f"LaTeX: \\end{{{name}}} ends another environment")
    expect(not open_ones, f"LaTeX: {open_ones} not ended")
    unknown = set(re.findall(r"\\([A-Za-z]+)", body)) - COMMANDS
    expect(not unknown, f"LaTeX: unknown commands {sorted(unknown)}")
    expect(body.count("$") % 2 == 0, "LaTeX: mathematics left open")
    others = {c for c in body if not c.isascii()} - {"é"}
    expect(not others, f"LaTeX: {sorted(others)} where there should be commands")


def latex_tables(text):
    """(caption, kinds of columns, rows of cells) of each table."""
    tables = []
    for table in re.findall(r"\\begin\{table\*\}.*?\\end\{table\*\}", text, re.S):
        caption = re.search(r"\\caption\{(.*)\}\n", table)
        columns = re.search(r"\\begin\{tabular\}\{\n(.*?)\n\}\n", table, re.S).group(1).split("\n")
        head = table.split("\\toprule\n")[1].split("\\midrule\n")[0]
        body = table.split("\\midrule\n")[1].split("\\bottomrule")[0]
        rows = [[c.strip() for c in re.split(r"(?<!\\)&", line)] for line in body.split("\\\\\n") if line]
        for line in head.split("\\\\\n"):
            cells = re.split(r"(?<!\\)&", line)
            spans = sum(int(n) - 1 for n in re.findall(r"\\multicolumn\{(\d+)\}", line))
            if line.strip() and not line.startswith("\\cmidrule"):
                expect(len(cells) + spans == len(columns), f"LaTeX: {len(cells)} cells in the head of {len(columns)} columns")
        for row in rows:
            expect(len(row) == len(columns), f"LaTeX: {len(row)} cells in {len(columns)} columns: {row}")
            for kind, cell in zip(columns, row):
                number = re.fullmatch(r"[-+]?\d+(\.\d+)?(e-?\d+)?", cell)
                expect(not kind.strip().startswith("S") or number or re.fullmatch(r"\{.*\}", cell),
                       f"LaTeX: '{cell}' in a column of numbers")
        tables.append((caption.group(1) if caption else "", [c.strip()[0] for c in columns], rows))
    return tables


def set_in_type(text):
    if not shutil.which("pdflatex"):
        return leave_out("pdflatex, which sets the LaTeX,")
    with tempfile.TemporaryDirectory() as folder:
        with open(f"{folder}/t.tex", "w", encoding="utf-8") as file:
            file.write(f"\\documentclass[twocolumn]{{article}}\\usepackage{{{PACKAGES}}}\n")
            file.write(f"\\begin{{document}}\n{text}\n\\end{{document}}\n")
        run = subprocess.run(["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "t.tex"],
                             cwd=folder, env={**os.environ, "TEXMFVAR": folder}, capture_output=True, check=False)
        said = run.stdout.decode(errors="replace")
    expect(run.returncode == 0, f"pdflatex: {said[-800:]}")
    for line in said.splitlines():
        if re.match("!|Overfull|LaTeX Warning|Package .* Warning", line) and "No file t.aux" not in line:
            faults.append(f"pdflatex: {line}")


# ---- Both against CSV --------------------------------------------------------------------------


def plain(latex):
    """A LaTeX cell as Markdown."""
    for command, character in {"$-$": "-", "$\\pm$": "±", "{--}": "–", "--": "–", "\\%": "%", "\\_": "_"}.items():
        latex = latex.replace(command, character)
    return latex.strip("{}")


def compare_trims(markdown, latex, rows):
    keys = ["name", "V", "gamma_deg", "eta_deg", "theta_deg", "alpha_deg", "theta0", "a1s_deg", "delta_e_deg", "residual"]
    for form, cells in (("Markdown", markdown[1:]), ("LaTeX", [[plain(c) for c in r] for r in latex])):
        expect(len(cells) == len(rows), f"{form}: {len(cells)} conditions, CSV has {len(rows)}")
        for line, row in zip(cells, rows):
            expect(line[0].replace("\\", "") == row["name"], f"{form}: '{line[0]}' for {row['name']}")
            for key, cell in zip(keys[1:], line[1:]):
                expect(shows(cell, row[key]), f"{form}: {row['name']}: {key} is {cell}, CSV has {row[key]}")


def compare_modes(form, name, table, rows):
    shown = [r for r in rows if float(r["im"]) >= 0]
    expect(len(table) == len(shown), f"{form}: {name}: {len(table)} eigenvalues, CSV has {len(shown)}")
    for line, row in zip(table, shown):
        eigenvalue, error, frequency, damping, half, condition, mode = line[:7]
        re_part, _, im_part = eigenvalue.partition(" ± ")
        expect(shows(re_part, row["re"]), f"{form}: {name}: {eigenvalue}, CSV has {row['re']}")
        expect(shows(im_part.rstrip("i") or "0", row["im"]), f"{form}: {name}: {eigenvalue}, CSV has {row['im']}")
        for key, cell in (("error", error), ("frequency", frequency), ("damping", damping), ("time_to_half", half),
                          ("condition", condition)):
            expect(shows(cell, row[key]), f"{form}: {name}: {key} is {cell}, CSV has {row[key]}")
        expect(mode.replace("\\", "").startswith(row["mode"]), f"{form}: {name}: mode {mode}, CSV has {row['mode']}")


# ---- Conditions without an answer, and names that are markup -------------------------------------

HOSTILE = "a_b 100% $x$ & #1 {c} \\\\input{d} ^ ~ <b>e</b> | `f` *g* [h](i) 'j' \\\"k\\\" é γ"


def unescaped(markdown):
    for entity, character in {"&lt;": "<", "&gt;": ">", "&amp;": "&"}.items():
        markdown = markdown.replace(entity, character)
    return re.sub(r"\\(.)", r"\1", markdown)


def check_refusal(program, command):
    """A condition without an answer is reported by name in every format; returns the LaTeX."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml", encoding="utf-8") as study:
        study.write(f'[[condition]]\nname = "{HOSTILE}"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n')
        study.write('[[condition]]\nname = "too fast"\nV = 95.0\ngamma_deg = 0.0\neta_deg = 0.0\n')
        study.flush()
        found = {c["name"]: c for c in json.loads(printed(program, command, study.name, "json"))["conditions"]}
        markdown = printed(program, command, study.name, "markdown")
        latex = printed(program, command, study.name, "latex")
    name = next(n for n in found if n != "too fast")
    refused = found["too fast"]
    expect(refused["status"] in ("infeasible", "not_found"), f"too fast: {refused['status']}")
    expect("<b>" not in markdown, f"{command}: Markdown lets a tag through")
    for words in (name, "too fast", refused["status"], refused["message"][-40:]):
        expect(words in unescaped(markdown), f"{command}: Markdown does not say '{words}'")
    for words in ("a\\_b 100\\% \\$x\\$ \\& \\#1 \\{c\\} \\textbackslash{}input\\{d\\}", "too fast", refused["status"].replace("_", "\\_")):
        expect(words in latex, f"{command}: LaTeX does not say '{words}'")
    return latex


def main():
    program, study = sys.argv[1:]
    trims = list(csv.DictReader(io.StringIO(printed(program, "trim", study, "csv"))))
    modes = list(csv.DictReader(io.StringIO(printed(program, "linearize", study, "csv"))))
    source = printed(program, "linearize", study, "latex")
    markdown, latex = markdown_tables(printed(program, "linearize", study, "markdown")), latex_tables(source)
    others = [printed(program, command, study, "latex") for command in ("margins", "sensitivities", "tables")]
    others += [check_refusal(program, command) for command in ("linearize", "margins")]
    for text in (source, *others):
        check_latex(text)
        latex_tables(text)
    set_in_type("\n".join((source, *others)))
    names = list(dict.fromkeys(r["name"] for r in modes if r["re"]))
    expect(len(markdown) == len(latex) == len(names) + 1, f"{len(markdown)} and {len(latex)} tables of {len(names)} models")
    compare_trims(markdown[0][1], latex[0][2], trims)
    for name, (title, rows), (caption, _, cells) in zip(names, markdown[1:], latex[1:]):
        own = [r for r in modes if r["name"] == name]
        verdict = own[0]["verdict"]
        for words in (title, caption):
            expect(words.startswith(name) and words.endswith(verdict), f"'{words}' is not {name}, {verdict}")
        compare_modes("Markdown", name, rows[1:], own)
        compare_modes("LaTeX", name, [[plain(c) for c in r] for r in cells], own)
    print("\n".join(faults) or f"{len(trims)} trims and {len(modes)} eigenvalues are the same in Markdown, LaTeX and CSV")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
