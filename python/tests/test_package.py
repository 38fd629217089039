"""The package as a user reads it: reprs, HTML, docstrings, types, and stubs that match it."""

import ast
import html.parser
import inspect
import os
import pydoc
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from written_models import BALL, held_ball, magnet

import tiltrim
from tiltrim import _tiltrim

PACKAGE = Path(__file__).resolve().parents[1] / "tiltrim"


def results():
    """One result of each kind."""
    problem = held_ball()
    held = tiltrim.trim(problem)
    linear = tiltrim.linearize(held)
    branch = tiltrim.follow(held, parameter="k_p", to=150)
    tuned = tiltrim.tune(problem, gains={"k_d": (0.5, 20.0)}, evaluations=60)
    study = tiltrim.read_study(PACKAGE.parents[1] / "studies/transition.toml")
    found = tiltrim.modes(linear)
    return [
        problem.model, problem.guess, problem, held, linear, found, found[0], branch,
        branch.events[-1], tuned, tuned.achieved[0], tuned.effects[0],
        tiltrim.simulate(problem.model, held, 0.5), tiltrim.fly(study), study,
        next(iter(study.conditions.values())), tiltrim.tiltrotor(formulation="airframe"),
        *others(),
    ]  # fmt: skip


def others():
    """What is computed of a condition alone."""
    level = tiltrim.tiltrotor()
    margins = tiltrim.margins(level)
    envelope = tiltrim.envelope(level, count=5)
    found = tiltrim.all_equilibria(level, starts=5)
    flights = tiltrim.MonteCarlo(
        1, 1, 0, 0.0, 0.0, 0.98, {"lost": 1},
        [tiltrim.ScatteredFlight(0, "lost", False, 3.0, 1.0, 0.1, 0.0, 1.4, 2.0, {"mass": 5.0})],
        "", False,
    )  # fmt: skip
    return [
        margins, margins["delta_e"], envelope, envelope.pieces[0], found, found[0], flights,
        flights.worst[0], tiltrim.Report("page.html", "stable", True),
        tiltrim.Robustness(20, 19, 0, 1, 0.95, 0.75, 0.999, 0.1, "level", False),
    ]  # fmt: skip


class Balanced(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.text = [], ""

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_every_result_has_a_text_and_an_html_page_of_the_same_words():
    for result in results():
        text, page = repr(result), Balanced()
        page.feed(result._repr_html_())
        assert page.open == []
        assert "object at 0x" not in text and max(map(len, text.splitlines())) < 200
        first = text.splitlines()[0]
        assert first and first in page.text


def test_names_are_escaped_in_html():
    m = tiltrim.Model("<b>&", lambda x, u, p: -x, states=[("<i>", "m/s & more")])
    page = tiltrim.trim(m, {}, free=["<i>"], steady=["<i>"])._repr_html_()
    assert "<i>" not in page and "&lt;i&gt;" in page and "&lt;b&gt;&amp;" in page
    assert "m/s &amp; more" in page


def test_the_text_says_status_numbers_and_units():
    held = tiltrim.trim(
        magnet(), {**BALL, "gap": 0.01}, free=["current"], steady=["rate"],
        bounds={"current": (0, 1)},
    )
    assert repr(held).splitlines()[0] == "converged: magnet"
    assert "  input      current         1  A        at its upper limit" in repr(held).splitlines()
    assert "  state      gap          0.01  m" in repr(held).splitlines()


def members(thing):
    return [
        (name, member)
        for name, member in vars(thing).items()
        if not name.startswith("_") and (callable(member) or isinstance(member, property))
    ]


def test_everything_public_has_a_docstring():
    assert tiltrim.__doc__
    for name in tiltrim.__all__:
        thing = getattr(tiltrim, name)
        assert inspect.getdoc(thing), name
        own = inspect.getdoc(thing)
        assert not own.startswith(f"{name}("), f"{name}: only a generated docstring"
        if inspect.isclass(thing) and not issubclass(thing, (Exception, tuple)):
            for member_name, member in members(thing):
                assert inspect.getdoc(member), f"{name}.{member_name}"


def test_all_is_what_is_public():
    own = {
        name
        for name, thing in vars(tiltrim).items()
        if not name.startswith("_") and not inspect.ismodule(thing) and name != "annotations"
    }
    assert own == set(tiltrim.__all__)
    assert sorted(tiltrim.__all__) == tiltrim.__all__


def test_every_verb_says_all_its_options():
    for verb in (tiltrim.trim, tiltrim.follow, tiltrim.linearize, tiltrim.sweep, tiltrim.tune,
                 tiltrim.simulate, tiltrim.margins, tiltrim.envelope, tiltrim.all_equilibria,
                 tiltrim.monte_carlo, tiltrim.report, tiltrim.lqr, tiltrim.place, tiltrim.lyapunov,
                 tiltrim.hinf_norm, tiltrim.h2_norm):  # fmt: skip
        of_the_problem = {*inspect.signature(tiltrim.TrimSpec).parameters, "spec", "guess"}
        for name in set(inspect.signature(verb).parameters) - of_the_problem:
            assert name in (verb.__doc__ or ""), f"{verb.__name__}: {name}"


def test_every_verb_shows_the_fields_of_a_spec():
    fields = inspect.signature(tiltrim.TrimSpec).parameters
    assert list(fields) == [*tiltrim.TrimSpec.__dataclass_fields__, "still"]
    for verb in (tiltrim.trim, tiltrim.follow, tiltrim.sweep, tiltrim.tune, tiltrim.Problem,
                 tiltrim.envelope, tiltrim.all_equilibria):  # fmt: skip
        shown = inspect.signature(verb).parameters
        for name, field in fields.items():
            assert shown[name] == field.replace(kind=field.KEYWORD_ONLY), verb
        assert "spec" in shown and "fields" not in shown
        assert "steady: 'Sequence[str]' = ()" in pydoc.render_doc(verb)


# ---- Stubs --------------------------------------------------------------------------------------


def stubbed():
    """{name: parameters} of functions and methods, {name: None} for everything else."""
    found = {}
    tree = ast.parse((PACKAGE / "_tiltrim.pyi").read_text())

    def parameters(function):
        names = [a.arg for a in function.args.args]
        return names[1:] if names[:1] == ["self"] else names

    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = parameters(node)
        elif isinstance(node, ast.AnnAssign):
            found[node.target.id] = None
        elif isinstance(node, ast.ClassDef):
            found[node.name] = None
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    is_property = any(
                        isinstance(d, ast.Name) and d.id == "property"
                        for d in member.decorator_list
                    )
                    name = f"{node.name}.{member.name}"
                    found[name] = None if is_property else parameters(member)
    return found


def signature_in(docstring, name):
    """Parameters as pybind11 writes them: "name(a: type, b: type) -> ..."."""
    line = next(line for line in docstring.splitlines() if line.startswith(f"{name}("))
    words = [w.strip() for w in ast_safe_split(line[len(name) + 1 : line.rindex(") ->")])]
    names = [w.split(":")[0].strip() for w in words if w]
    return names[1:] if names[:1] == ["self"] else names


def ast_safe_split(text):
    depth, part = 0, ""
    for c in text:
        depth += (c in "[(<") - (c in "])>")
        if c == "," and depth == 0:
            yield part
            part = ""
        else:
            part += c
    yield part


def test_the_stubs_are_those_of_the_module():
    stubs = stubbed()
    there = {}
    for name, thing in vars(_tiltrim).items():
        if name.startswith("__"):
            continue
        if inspect.isclass(thing):
            there[name] = None
            for member, value in vars(thing).items():
                if isinstance(value, property):
                    there[f"{name}.{member}"] = None
                elif not member.startswith("_") or (member == "__init__" and name == "Model"):
                    if callable(value) and "(" in (value.__doc__ or ""):
                        there[f"{name}.{member}"] = signature_in(value.__doc__, member)
        elif callable(thing):
            there[name] = signature_in(thing.__doc__, name)
        else:
            there[name] = None
    anonymous = {k: v for k, v in there.items() if v and any(n.startswith("arg") for n in v)}
    assert anonymous == {}
    assert there == stubs


def test_types(tmp_path):
    """The package and a user's program type-check; every error in a faulty program is reported."""
    pytest.importorskip("mypy")
    wrong = tmp_path / "wrong.py"
    wrong.write_text(
        "import tiltrim\nheld = tiltrim.trim(tiltrim.tiltrotor())\nname: int = held.status\n"
        "tiltrim.trim(3)\nheld.pont\ntiltrim.trim(held.model, {}, fre=['x'])\n"
    )
    program = Path(__file__).parent / "typed_program.py"
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull]
        + ["--enable-incomplete-feature=Unpack"]  # mypy 1.0: keywords typed by a TypedDict
        + [str(file) for file in (PACKAGE, program, wrong)],
        capture_output=True,
        text=True,
        cwd=PACKAGE.parent,
    )
    faults = [line for line in done.stdout.splitlines() if ": error: " in line]
    assert len(faults) == 4, done.stdout + done.stderr
    for line, what in ((3, "assignment"), (4, "call-overload"), (5, "attr-defined"),
                       (6, "call-overload")):
        assert any(f"wrong.py:{line}:" in s and f"[{what}]" in s for s in faults), done.stdout
    subprocess.run([sys.executable, program], check=True)


def test_arrays_are_arrays():
    held = tiltrim.trim(held_ball())
    assert held.point.x.dtype == np.float64 and held.rates.flags.c_contiguous
    linear = tiltrim.linearize(held)
    assert (linear.A.dtype, linear.A.shape) == (np.float64, (2, 2))
