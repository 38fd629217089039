"""Signals, models, points: names in, numbers out, errors reported by name."""

import dataclasses
import gc
import weakref

import numpy as np
import pytest
from written_models import BALL, held_ball, magnet, magnet_law

import tiltrim
from tiltrim import InvalidArgument, Model, Point, Signal


def test_signals_are_named_tuples_tuples_or_strings():
    m = Model("m", lambda x, u, p: x, states=["a", ("b", "m"), Signal("c", "s", 0.5)])
    assert m.states == (Signal("a"), Signal("b", "m", 1.0), Signal("c", "s", 0.5))
    for wrong in ("abc", [("a", 3)], [(1, "m")]):
        with pytest.raises((InvalidArgument, TypeError)):
            Model("m", lambda x, u, p: x, states=wrong)


def test_a_point_is_read_and_written_by_name():
    m = magnet()
    point = m.point(BALL, gap=0.01, current=1.5)
    assert (point["gap"], point["rate"], point["current"]) == (0.01, 0.0, 1.5)
    np.testing.assert_array_equal(point.p, [0.1, 9.81e-5])
    point["current"] = 2.0
    assert point.u[0] == 2.0
    assert point.replace(gap=0.02)["gap"] == 0.02 and point["gap"] == 0.01
    assert list(point) == ["gap", "rate", "current", "mass", "k"]
    assert dict(**point.as_dict())["mass"] == 0.1
    with pytest.raises(ValueError, match="no signal 'curent' .nearest: 'current'.; the model has"):
        point["curent"]
    with pytest.raises(ValueError, match="no value for the parameter 'k'"):
        m.point(gap=0.01, mass=0.1)
    with pytest.raises(ValueError, match="state x: expected 2 values, got 3"):
        Point(m, x=[1, 2, 3])
    with pytest.raises(ValueError, match="expected 2 real values"):
        Point(m, x=[1, 2j])
    with pytest.raises(ValueError, match="signals differ"):
        magnet_law().point(point)


def test_functions_are_evaluated_as_they_are_written():
    rates, outputs = magnet().evaluate({**BALL, "gap": 0.02, "rate": 0.3, "current": 1.0})
    np.testing.assert_allclose(rates, [0.3, 9.81 - 9.81e-5 / 0.02**2 / 0.1], rtol=1e-15)
    assert outputs.shape == (0,)


def test_a_loop_is_closed_by_names():
    loop = tiltrim.close_loop(magnet(), magnet_law())
    assert [s.name for s in loop.states] == ["gap", "rate"]
    assert loop.inputs == ()
    assert [s.name for s in loop.outputs] == ["current"]
    with pytest.raises(InvalidArgument, match="the loop is not closed"):
        tiltrim.close_loop(magnet(), Model("other", None, outputs=["y"], h=lambda x, u, p: [0.0]))


def test_mistakes_have_the_words_of_the_library():
    m = magnet()
    at = {**BALL, "gap": 0.01, "current": 1.0}
    with pytest.raises(InvalidArgument, match=r"no signal 'curent' \(nearest: 'current'\)"):
        tiltrim.trim(m, at, free=["curent"], steady=["rate"])
    with pytest.raises(ValueError, match="bounds of 'current' are reversed"):
        tiltrim.trim(m, at, free=["current"], steady=["rate"], bounds={"current": (3, 0)})
    with pytest.raises(ValueError, match="no method 'nweton'"):
        tiltrim.trim(m, at, free=["current"], steady=["rate"], method="nweton")
    with pytest.raises(TypeError, match="expected a list of names"):
        tiltrim.trim(m, at, free="current", steady=["rate"])
    with pytest.raises(TypeError, match="needs a guess"):
        tiltrim.trim(m, free=["current"])
    with pytest.raises(ValueError, match="used twice"):
        Model("m", lambda x, u, p: x, states=["a", "a"])
    with pytest.raises(TypeError, match="f: expected a function"):
        Model("m", [1.0], states=["a"])


def test_a_number_given_as_text_is_refused():
    m = magnet()
    at = {**BALL, "gap": 0.01, "current": 1.0}
    asked = {"free": ["current"], "steady": ["rate"]}
    with pytest.raises(TypeError, match="current: expected a number, got '1'"):
        m.point({**at, "current": "1"})
    with pytest.raises(TypeError, match="bounds: current: expected a number, got '0'"):
        tiltrim.trim(m, at, **asked, bounds={"current": ("0", 3)})
    with pytest.raises(TypeError, match="rates: rate: expected a number, got '0'"):
        tiltrim.trim(m, at, free=["current"], rates={"rate": "0"})
    with pytest.raises(TypeError, match="current: expected a number, got '1'"):
        tiltrim.simulate(m, at, 1.0, changes=[("current", "1")])
    with pytest.raises(InvalidArgument, match="expected a name, a unit and a nominal size, got"):
        Model("m", lambda x, u, p: x, states=[("a", "m", "1")])


HELD = {**BALL, "gap": 0.01, "current": 1.0}
FREE = {"free": ["current"], "steady": ["rate"]}


@pytest.mark.parametrize(
    "words, call",
    [
        ("bounds: expected {signal", lambda: tiltrim.trim(magnet(), HELD, **FREE, bounds=[1])),
        ("a tolerance of nan", lambda: tiltrim.trim(magnet(), HELD, **FREE, tolerance=np.nan)),
        ("-1 starts", lambda: tiltrim.trim(magnet(), HELD, **FREE, starts=-1)),
        ("time_limit: expected a number", lambda: tiltrim.trim(held_ball(), time_limit="3")),
        ("point: expected values by name or a Point", lambda: magnet().point(np.zeros(5))),
        ("gap: expected a number", lambda: magnet().point({**HELD, "gap": [1, 2]})),
        ("expected a list of signals, got 3", lambda: Model("m", len, states=3)),
        ("expected a name, a unit", lambda: Model("m", len, states=[("a", "m", 1, 2)])),
        ("inputs: expected a list", lambda: tiltrim.linearize(magnet(), HELD, inputs="current")),
        ("inputs: 'current' is listed twice", lambda: tiltrim.linearize(
            magnet(), HELD, inputs=["current", "current"])),
        ("inputs: 'current' is listed twice", lambda: tiltrim.sweep(
            held_ball(), axes={"k_p": [80.0, 90.0]}, inputs=["current", "current"])),
        ("parameters: expected a list", lambda: tiltrim.sensitivities(held_ball(), "mass")),
        ("'mass' is listed twice", lambda: tiltrim.sensitivities(held_ball(), ["mass", "mass"])),
        ("to: expected a number", lambda: tiltrim.follow(held_ball(), parameter="k_p", to="9")),
        ("a longest step of nan", lambda: tiltrim.follow(
            held_ball(), parameter="k_p", to=90, max_step=np.nan)),
        ("max_points is -1", lambda: tiltrim.follow(
            held_ball(), parameter="k_p", to=90, max_points=-1)),
        ("duration: expected a number", lambda: tiltrim.simulate(magnet(), HELD, "1")),
        ("changes: expected .signal", lambda: tiltrim.simulate(
            magnet(), HELD, 1.0, changes={"current": 1})),
        ("axes: expected {signal", lambda: tiltrim.sweep(held_ball(), axes=[("k_p", [1, 2])])),
        ("axis k_p: 3.* after 3.*; expected ascending or descending", lambda: tiltrim.sweep(held_ball(), axes={"k_p": [2, 3, 3]})),
        ("threads: .* from 0 to 1024, got -1", lambda: tiltrim.sweep(
            held_ball(), axes={"k_p": [2, 3]}, threads=-1)),
        ("nothing to tune: no gain is free", lambda: tiltrim.tune(held_ball())),
        ("gains: k_d: expected .lower", lambda: tiltrim.tune(held_ball(), gains={"k_d": 3})),
        ("evaluations: .* got 1.5", lambda: tiltrim.tune(
            held_ball(), gains={"k_d": (1, 2)}, evaluations=1.5)),
        ("seed: .* got -1", lambda: tiltrim.tune(held_ball(), gains={"k_d": (1, 2)}, seed=-1)),
        ("seconds: expected 0 or more, got nan", lambda: tiltrim.tune(
            held_ball(), gains={"k_d": (1, 2)}, seconds=np.nan)),
        ("uncertain: mass: expected .lower", lambda: tiltrim.tune(
            held_ball(), gains={"k_d": (1, 2)}, uncertain={"mass": 3})),
        ("start cannot be 'a'", lambda: tiltrim.tune(
            held_ball(), gains={"k_d": (1, 2)}, start="a")),
        ("longest_step cannot be 'a'", lambda: tiltrim.simulate(
            magnet(), HELD, 1.0, longest_step="a")),
        ("more than 2000000 samples", lambda: tiltrim.simulate(magnet(), HELD, 1.0, sample=1e-9)),
        ("breaks: expected finite, increasing times, got .2.5, nan", lambda: tiltrim.simulate(
            magnet(), HELD, 5.0, lambda t: [1.0], breaks=[2.5, np.nan])),
        ("breaks: expected finite, increasing times", lambda: tiltrim.simulate(
            magnet(), HELD, 5.0, lambda t: [1.0], breaks=[2.5, 1.0])),
        ("breaks: expected a number, got '1'", lambda: tiltrim.simulate(
            magnet(), HELD, 5.0, lambda t: [1.0], breaks=["1"])),
        ("breaks without input.t", lambda: tiltrim.simulate(magnet(), HELD, 5.0, breaks=[1.0])),
        ("only= names conditions of a study; Model has none", lambda: tiltrim.sweep(
            magnet(), HELD, axes={"k": [1, 2]}, only=["nobody"], **FREE)),
        ("only: expected a list of names", lambda: tiltrim.sweep(
            held_ball(), axes={"k_p": [2, 3]}, only="nobody")),
        ("states: 'a.ud800b' is not valid Unicode text", lambda: Model(
            "m", lambda x, u, p: x, states=["a\ud800b"])),
        ("name: 'a.ud800b' is not valid", lambda: Model("a\ud800b", lambda x, u, p: x, ["a"])),
        ("switches: '.udfff' is not valid", lambda: Model(
            "m", lambda x, u, p: x, ["a"], switches={"\udfff": lambda x, u, p: 1.0})),
        ("max_step cannot be 'a'", lambda: tiltrim.follow(
            held_ball(), parameter="k_p", to=90, max_step="a")),
        ("moving: expected a list", lambda: tiltrim.linearize(held_ball(), moving="gap")),
        ("count: .* got 5.5", lambda: tiltrim.envelope(
            held_ball(), along=("k_p", 90, 200), over=("k_d", 1, 2), count=5.5)),
        ("rows: expected finite", lambda: tiltrim.envelope(
            held_ball(), along=("k_p", 90, 200), over=("k_d", 1, 2), rows=[np.nan])),
        ("number: .* got 1.5", lambda: tiltrim.fly(tiltrim.tiltrotor(), number=1.5)),
    ],
)
def test_a_wrong_argument_is_named(words, call):
    with pytest.raises((InvalidArgument, TypeError), match=words):
        call()


def test_a_change_after_the_end_of_a_motion_is_refused():
    at = {**BALL, "gap": 0.01, "current": 1.0}
    with pytest.raises(InvalidArgument, match="current begins at 3 s, not before the end .* 2 s"):
        tiltrim.simulate(magnet(), at, 2.0, changes=[("current", 0.1, 3.0)])


def test_a_study_that_is_wrong_says_where():
    with pytest.raises(tiltrim.StudyError, match="mine:2:1: unknown key 'V_'.* did you mean 'V'"):
        tiltrim.parse_study("[[condition]]\nV_ = 3\n", "mine")
    with pytest.raises(tiltrim.StudyError, match="mas"):
        tiltrim.tiltrotor(aircraft={"mas": 4.0})
    with pytest.raises(tiltrim.StudyError, match="nowhere.toml"):
        tiltrim.read_study("nowhere.toml")


class Plant:
    """Holds the model that calls its own method: a reference cycle."""

    def __init__(self):
        self.model = Model("plant", self.rates, states=["x"])
        self.loop = tiltrim.close_loop(
            Model("plant", self.rates, states=["y"], inputs=["v"]),
            Model("law", None, inputs=["y"], outputs=["v"], h=self.outputs),
        )

    def rates(self, x, u, p):
        return -x

    def outputs(self, x, u, p):
        return -u


def test_cycles_through_a_model_are_collected():
    plant = Plant()
    assert tiltrim.trim(plant.loop, {}, free=["y"], steady=["y"])
    assert plant.rates in gc.get_referents(plant.model._core)
    gone = weakref.ref(plant)
    del plant
    gc.collect()
    assert gone() is None


def test_arrays_of_a_callable_are_its_own():
    kept = []

    def f(x, u, p):
        kept.append(x)
        x[:] = 7.0  # has no effect
        return [1.0 - kept[-1][0] * 0]

    m = Model("m", f, states=["x"])
    rates, _ = m.evaluate({"x": 3.0})
    assert rates[0] == 1.0
    m.evaluate({"x": 4.0})
    assert kept[0] is not kept[1]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda x: x.fill(np.nan),
        lambda x: x.setflags(write=False),
        lambda x: setattr(x, "dtype", np.int64),
        lambda x: setattr(x, "shape", (1, 2)),
        lambda x: x.resize(5, refcheck=False),
    ],
)
def test_whatever_a_callable_does_to_its_arrays_the_next_call_has_good_ones(spoil):
    def f(x, u, p):
        answer = [x[1] - 0.5, 2.0 - x[0] - 0.1 * x[1] ** 2]
        assert x.dtype == float and x.flags.writeable
        spoil(x)
        return answer

    model = Model("spoils", f, states=["a", "b"])
    for _ in range(3):
        held = tiltrim.trim(model, {})
        assert held and held.point.x == pytest.approx([1.975, 0.5], abs=1e-9)


def test_an_array_that_a_callable_keeps_a_part_of_is_not_used_again():
    kept = []

    def f(x, u, p):
        kept.append((x[:1], float(x[0])))
        return x * x - 2.0  # a new array; below, the argument itself

    tiltrim.trim(Model("part", f, states=["x"]), {"x": 1.0}, others=False)
    assert all(part[0] == value for part, value in kept) and len(kept) > 5
    itself = Model("itself", lambda x, u, p: x, states=["x", "y"])
    assert tiltrim.trim(itself, {"x": 1.0, "y": -2.0})
    within = Model("within", lambda x, u, p: [x[0] - itself.evaluate({"x": 3.0})[0][0]], states=["x"])
    assert tiltrim.trim(within, {})["x"] == pytest.approx(3.0, abs=1e-12)


def test_problems_are_trimmed_as_they_stand():
    held = tiltrim.trim(held_ball())
    assert held and held["gap"] == pytest.approx(0.01, abs=1e-12)
    assert held["current"] == pytest.approx(1.0, abs=1e-10)  # z sqrt(m g/k)
    with pytest.raises(TypeError, match="its own"):
        tiltrim.trim(held_ball(), free=["gap"])


def test_steady_has_an_old_name():
    new, old = tiltrim.TrimSpec(["gap"], ["rate"]), tiltrim.TrimSpec(["gap"], still=["rate"])
    assert new == old and old.steady == old.still == ("rate",)
    assert dataclasses.replace(old, steady=["gap"]).still == ("gap",)
    at = {**BALL, "gap": 0.01, "current": 0.5}
    asked = {"free": ["current"], "bounds": {"current": (0, 3)}}
    one = tiltrim.trim(magnet(), at, steady=["rate"], **asked)
    other = tiltrim.trim(magnet(), at, still=["rate"], **asked)
    assert one and one.spec == other.spec and one["current"] == other["current"]
    with pytest.raises(TypeError, match="still: expected a list of names"):
        tiltrim.TrimSpec(still="rate")


def verbs():
    """Every verb that takes the fields of a TrimSpec, with its other arguments."""
    m, at = magnet(), {**BALL, "gap": 0.01, "current": 1.0}
    return {
        "trim": lambda **asked: tiltrim.trim(m, at, **asked),
        "follow": lambda **asked: tiltrim.follow(m, at, "mass", 0.2, **asked),
        "sweep": lambda **asked: tiltrim.sweep(m, at, axes={"mass": [0.1]}, **asked),
        "tune": lambda **asked: tiltrim.tune(m, at, gains={"k": (1e-5, 1e-4)}, **asked),
        "Problem.__init__": lambda **asked: tiltrim.Problem(m, at, **asked),
    }


@pytest.mark.parametrize("verb", verbs())
def test_both_names_and_misspelt_ones_are_refused(verb):
    with pytest.raises(TypeError, match="still is the old name of steady.* got both"):
        verbs()[verb](free=["current"], steady=["rate"], still=["rate"])
    with pytest.raises(TypeError, match=rf"{verb}\(\) got an unexpected keyword argument 'fre'"):
        verbs()[verb](fre=["current"], steady=["rate"])
    with pytest.raises(TypeError, match="unexpected keyword argument 'fre'"):
        verbs()[verb](spec=tiltrim.TrimSpec(["current"], ["rate"]), fre=["current"])


def resident():
    """Resident memory of this process, bytes."""
    import resource
    from pathlib import Path

    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def test_nothing_is_left_behind():
    def raising(x, u, p):
        if x[0] > 0.5:
            raise ValueError("too far")
        return [1.0 - x[0]]

    problem = tiltrim.Problem(
        Model("m", raising, states=["x"]), {"x": 0.2}, free=["x"], steady=["x"],
        bounds={"x": (-2, 2)},
    )  # fmt: skip
    ball = held_ball()

    def work(times):
        for _ in range(times):
            tiltrim.modes(tiltrim.linearize(tiltrim.trim(ball, method="newton", starts=0)))
            tiltrim.trim(problem, method="newton", starts=4, closest=False)
            tiltrim.simulate(ball.model, ball.guess, 0.05)
            with pytest.raises(InvalidArgument):
                Model("m", lambda x, u, p: None, states=["x"]).evaluate({})
        gc.collect()

    work(50)  # what is kept once
    before = resident()
    work(500)
    assert resident() - before < 2e6  # bytes: less than 4 kB each
