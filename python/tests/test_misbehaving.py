"""Models that misbehave: for every verb, each failure has a named status or an exception (the table
of docs/your-model.md)."""

import ctypes
import math
import platform
import traceback

import numpy as np
import pytest
from written_models import held_ball

import tiltrim
from tiltrim import InvalidArgument, Model

ASKED = {"free": ["x"], "steady": ["x"], "bounds": {"x": (-10, 10)}}


def scalar(rate):
    """x' = rate(x, p)."""
    return Model("mine", lambda x, u, p: rate(x[0], p[0]), states=["x"], parameters=["p"])


def trimmed(model, **options):
    return tiltrim.trim(model, {"x": 0.5, "p": 1.0}, **ASKED, **options)


def linear_at(model, x):
    return tiltrim.linearize(model, {"x": x, "p": 1.0})


def branch_from(model, x):
    return tiltrim.follow(model, {"x": x, "p": 1.0}, "p", 2.0, **ASKED)


def statuses(model):
    """At p = 1, 1.5 and 2, and the map's attributes."""
    pytest.importorskip("xarray")
    ds = tiltrim.sweep(model, {"x": 0.5, "p": 1.0}, axes={"p": [1.0, 1.5, 2.0]}, **ASKED)
    return ds.status.values.tolist(), ds


def raises(error):
    def rate(x, p):
        raise error

    return scalar(rate)


def test_it_raises():
    m = raises(RuntimeError("no row 7"))
    result = trimmed(m)
    assert result.status == "model_threw" and "RuntimeError: no row 7" in result.message
    assert isinstance(result.exception, RuntimeError)
    words = "".join(traceback.format_exception(result.exception))
    assert "test_misbehaving.py" in words and "raise error" in words
    linear = linear_at(m, 1.0)
    assert linear.status == "model_threw" and not linear
    assert linear.message == "the model threw: RuntimeError: no row 7"
    assert isinstance(linear.exception, RuntimeError) and linear.exception.__traceback__
    branch = branch_from(m, 1.0)
    assert branch.end == "no_start" and "the model threw: RuntimeError: no row 7" in branch.message
    assert isinstance(branch.exception, RuntimeError)
    three, ds = statuses(m)
    assert three == ["model_threw"] * 3 and "no row 7" in str(ds.reason.values[0])
    assert "test_misbehaving.py" in ds.attrs["exception"]
    words = "at 3 of 3 points; first: the model threw: RuntimeError: no row 7"
    assert ds.attrs["model_threw"] == words and "at 3 of 3 points" in str(ds)
    for motion in (
        tiltrim.simulate(m, {"x": 0.0, "p": 1.0}, 1.0),
        tiltrim.simulate(m, {"x": 0.0, "p": 1.0}, 1.0, lambda t: []),
    ):
        assert motion.status == "not_finite" and "RuntimeError: no row 7" in motion.message
        assert isinstance(motion.exception, RuntimeError)
    with pytest.raises(RuntimeError, match="no row 7") as caught:
        m.evaluate({"x": 0.0, "p": 1.0})
    assert any("test_misbehaving" in str(entry.path) for entry in caught.traceback[1:])
    tuned = tiltrim.tune(m, {"x": 0.5, "p": 1.0}, gains={"p": (1, 2)}, evaluations=20, **ASKED)
    assert tuned.status == "no_trim" and isinstance(tuned.exception, RuntimeError)
    assert "RuntimeError: no row 7" in tuned.message


def test_it_raises_beyond_a_point_alone():
    def rate(x, p):
        if p > 1.4:
            raise ValueError("the table ends at 1.4")
        return p - x

    m = scalar(rate)
    assert trimmed(m) and linear_at(m, 1.0)
    branch = branch_from(m, 1.0)
    assert branch.end == "not_finite" and "the table ends at 1.4" in branch.message
    assert branch.values[-1] == pytest.approx(1.4, abs=1e-3)
    three, ds = statuses(m)
    assert three == ["converged", "model_threw", "model_threw"]
    assert ds.crossing_kind.values.tolist() == ["end"]


def test_it_ends_in_a_vertical_slope():
    def followed(rate, to, start):
        return tiltrim.follow(scalar(rate), start, "p", to, free=["x"], steady=["x"])

    root = lambda v: math.sqrt(v) if v >= 0 else math.nan  # noqa: E731
    down = followed(lambda x, p: root(p) - x, -3.0, {"x": 1.0, "p": 1.0})
    up = followed(lambda x, p: root(1 - p) - x, 2.0, {"x": 1.0, "p": 0.0})
    assert down.end == up.end == "not_finite" and "x' = nan" in down.message
    assert down.values[-1] == pytest.approx(0.0, abs=1e-4)
    raised = followed(lambda x, p: math.sqrt(p) - x, -3.0, {"x": 1.0, "p": 1.0})
    assert raised.end == "not_finite" and "the model threw: ValueError" in raised.message


def test_exceptions_whose_own_words_raise():
    class Silent(Exception):
        def __str__(self):
            raise RuntimeError("no words")

    assert "Silent" in trimmed(raises(Silent())).message
    assert trimmed(raises(Exception())).status == "model_threw"


def test_it_raises_where_a_start_is_tried():
    def rate(x, p):
        if x > 3:
            raise ValueError("the table ends at 3")
        return p + x * x

    m = scalar(rate)
    result = trimmed(m)
    assert result.status == "not_found" and result.thrown == "ValueError: the table ends at 3"
    three, ds = statuses(m)
    assert three == ["not_found"] * 3 and "model_threw" not in ds.attrs
    assert "the model threw: ValueError: the table ends at 3" in str(ds.reason.values[0])


def test_it_takes_too_long():
    m = scalar(lambda x, p: p - x)
    late = {"time_limit": 1e-9}  # over before the first call
    result = trimmed(m, **late)
    assert result.status == "time_limit" and not result and result.evaluations == 0
    assert result.message == "the model exceeded the time limit of 1e-09 s: 0 evaluations"
    assert result["x"] == 0.5  # the guess
    linear = tiltrim.linearize(m, {"x": 1.0, "p": 1.0}, **late)
    assert linear.status == "time_limit" and "time limit of 1e-09 s" in linear.message
    problem = tiltrim.Problem(m, {"x": 0.5, "p": 1.0}, **ASKED)
    linear = tiltrim.linearize(problem, **late)  # trimmed first
    assert linear.status == "time_limit" and "the trim ended with time_limit" in linear.message
    branch = tiltrim.follow(problem, parameter="p", to=2.0, **late)
    assert branch.end == "no_start"
    tuned = tiltrim.tune(problem, gains={"p": (1, 2)}, evaluations=9, **late)
    assert tuned.status == "no_trim" and "time limit of 1e-09 s" in tuned.message
    assert tiltrim.sensitivities(problem, **late).status == "not_trim"
    with pytest.raises(ValueError, match="time limit of 1e-09 s"):
        tiltrim.modes(problem, **late)
    pytest.importorskip("xarray")
    ds = tiltrim.sweep(problem, axes={"p": [1.0, 2.0]}, **late)
    assert ds.status.values.tolist() == ["time_limit"] * 2
    assert str(ds.reason.values[0]) == "the model exceeded the time limit of 1e-09 s"
    for enough in (None, 1e6, math.inf):
        assert trimmed(m, time_limit=enough) and trimmed(m, time_limit=enough).message == ""
    for nothing in (0, -1, math.nan):
        with pytest.raises(ValueError, match="expected more than 0 s"):
            trimmed(m, time_limit=nothing)


def test_a_study_limits_the_time_of_its_trims():
    level = "[[condition]]\nname = 'level'\nV = 15.0\ngamma_deg = 0\neta_deg = 0\n"
    text = "time_limit = 1e-6\n" + level
    level = tiltrim.parse_study(text).conditions["level"]
    assert tiltrim.trim(level).status == "time_limit"
    assert tiltrim.trim(level, time_limit=1e6)
    assert tiltrim.follow(level, parameter="V", to=16.0).end == "no_start"


def test_it_gives_nan():
    for value in (math.nan, math.inf, np.nan, [math.nan], np.array([math.nan])):
        m = scalar(lambda x, p: value)
        assert trimmed(m).status == "not_finite"
        linear = linear_at(m, 1.0)
        assert linear.status == "not_finite" and "x' = " in linear.message
        assert branch_from(m, 1.0).end == "no_start"
        assert statuses(m)[0] == ["not_finite"] * 3
        assert tiltrim.simulate(m, {"x": 0.0, "p": 1.0}, 1.0).status == "not_finite"


WRONG = [
    (None, "expected 1 values, got None"),
    ("1.0", "expected 1 values, got a string"),
    ([0.0, 0.0], "expected 1 values, got 2"),
    ([], "expected 1 values, got 0"),
    (np.zeros((1, 1)), r"expected 1 values, got an array of shape \(1, 1\)"),
    ([[0.0], [0.0, 1.0]], "expected 1 values, got list"),
    ([None], "expected 1 values, got list"),
    ({"x": 1.0}, "expected 1 values, got dict"),
    (1j, "expected real values, got complex ones"),
    (np.array([1 + 0j]), "expected real values, got complex ones"),
    (object(), "expected 1 values, got object"),
    (np.array(["a"]), "expected 1 values, got numpy.ndarray"),
]


@pytest.mark.parametrize("answer, words", WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_it_answers_what_is_no_vector(answer, words):
    m = scalar(lambda x, p: answer)
    pytest.importorskip("xarray")
    for verb in (
        lambda: trimmed(m),
        lambda: trimmed(m, method="newton"),
        lambda: linear_at(m, 1.0),
        lambda: branch_from(m, 1.0),
        lambda: statuses(m),
        lambda: tiltrim.simulate(m, {"x": 0.0, "p": 1.0}, 1.0),
        lambda: tiltrim.tune(m, {"x": 0.5, "p": 1.0}, gains={"p": (1, 2)}, evaluations=9, **ASKED),
        lambda: m.evaluate({"x": 0.0, "p": 1.0}),
    ):
        with pytest.raises(InvalidArgument, match="model 'mine': its rates f: " + words):
            verb()


def test_it_answers_what_is_no_vector_beyond_a_point_alone():
    m = scalar(lambda x, p: None if x > 0.9 else 1.0 - x)
    with pytest.raises(ValueError, match="model 'mine': its rates f: expected 1 values, got None"):
        trimmed(m)


@pytest.mark.parametrize(
    "answer",
    [
        lambda v: v,
        lambda v: [v],
        lambda v: (np.float64(v),),
        lambda v: np.array([v, 0.0])[:1],
        lambda v: np.array([[v, 9.0], [9.0, 9.0]])[0, ::2],
        lambda v: np.asfortranarray(np.array([9.0, v]))[::-1][:1],
        lambda v: np.array([v], dtype=">f8"),
        lambda v: np.array(v),
    ],
)
def test_whatever_is_a_vector_of_numbers_will_do(answer):
    result = trimmed(scalar(lambda x, p: answer(p - x)))
    assert result.point["x"] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("answer", [np.float32, lambda v: np.array([v], dtype=np.float16)])
def test_single_precision_is_refused(answer):
    with pytest.raises(ValueError, match="expected numbers of double precision .float64., got ones of float"):
        trimmed(scalar(lambda x, p: answer(p - x)))


def test_it_jumps():
    over_zero = scalar(lambda x, p: 1.0 if x < p - 0.3 else -1.0)
    assert trimmed(over_zero).status == "not_found"
    assert linear_at(over_zero, 0.7).status == "not_equilibrium"
    assert branch_from(over_zero, 0.7).end == "no_start"
    assert statuses(over_zero)[0] == ["not_found"] * 3
    ahead = scalar(lambda x, p: (p + 1 if p > 1.4 else p) - x)
    branch = branch_from(ahead, 1.0)
    assert branch.end == "stuck" and "jump" in branch.message
    kink = scalar(lambda x, p: (2 if x < p else 1) * (p - x))
    assert ["at a kink of the model" in remark for remark in linear_at(kink, 1.0).remarks] == [True]


def test_a_switch_is_named():
    m = Model(
        "mine",
        lambda x, u, p: [(p[0] + 1 if p[0] > 1.4 else p[0]) - x[0]],
        states=["x"],
        parameters=["p"],
        switches={"the other gear": lambda x, u, p: p[0] - 1.4},
    )
    branch = branch_from(m, 1.0)
    assert branch.end == "switched" and "the other gear" in branch.message


def test_it_is_stiff():
    m = Model("stiff", lambda x, u, p: [1e9 * (p[0] - x[0]), x[0] - x[1]], ["x", "y"],
              parameters=["p"])  # fmt: skip
    asked = {"free": ["x", "y"], "steady": ["x", "y"]}
    result = tiltrim.trim(m, {"x": 0.5, "y": 0.5, "p": 1.0}, **asked)
    assert result and result["x"] == pytest.approx(1, abs=1e-15)
    found = tiltrim.modes(result)
    assert found.verdict == "stable"
    np.testing.assert_allclose(found.eigenvalues.real, [-1e9, -1.0], rtol=1e-6)
    assert tiltrim.follow(result, parameter="p", to=2.0).end == "reached"
    motion = tiltrim.simulate(m, {"x": 0.5, "y": 0.5, "p": 1.0}, 1.0, max_steps=1000)
    assert motion and motion.stiff and motion["y"][-1] == pytest.approx(1 - 0.5 * np.exp(-1))
    assert np.all(motion.error < 1e-6)


def test_its_jacobian_is_singular():
    m = scalar(lambda x, p: -((x - p) ** 3))
    result = trimmed(m)
    assert result.status == "singular" and not result and result.equilibrium
    assert tiltrim.modes(linear_at(m, 1.0)).verdict == "undecided"
    assert branch_from(m, result["x"]).end in ("stuck", "singular", "reached")
    three, ds = statuses(m)
    assert three == ["singular"] * 3 and set(ds.verdict.values) == {"undecided"}


def test_it_has_no_equilibrium():
    m = scalar(lambda x, p: p + x * x)
    result = trimmed(m)
    assert result.status == "not_found" and "the closest point has residual rate x' = 1" in result.message
    assert linear_at(m, 0.0).status == "not_equilibrium"
    assert branch_from(m, 0.0).end == "no_start"
    assert statuses(m)[0] == ["not_found"] * 3


def test_it_is_at_rest_everywhere():
    m = scalar(lambda x, p: 0.0)
    assert trimmed(m).status == "singular"
    assert tiltrim.modes(linear_at(m, 1.0)).verdict == "undecided"
    branch = branch_from(m, 1.0)
    assert branch.end == "singular" and "continuum" in branch.message
    three, ds = statuses(m)
    assert three == ["singular"] * 3 and set(ds.verdict.values) == {"undecided"}


def test_it_gives_two_answers_at_one_point():
    turn = iter(range(10**9))
    assert trimmed(scalar(lambda x, p: p - x + 1e-3 * (next(turn) % 2))).status == "not_repeatable"


def test_a_result_without_outputs_is_shown():
    nan = Model("nan", lambda x, u, p: [np.nan], ["x"], outputs=["y"], h=lambda x, u, p: [x[0]])
    result = tiltrim.trim(nan, {"x": 1.0}, bounds={"y": (0, 1)})
    assert result.status == "not_finite" and "not_finite: nan" in repr(result)
    assert np.isnan(result["y"])


def test_a_verb_within_a_function_is_refused_where_it_would_wait_for_itself():
    inner = held_ball()
    quick = {"method": "newton", "starts": 0, "closest": False}

    def rate(x, p):
        return p - x + 0 * tiltrim.trim(inner)["gap"]

    result = trimmed(scalar(rate), **quick)
    assert result.status == "model_threw"
    assert "trim inside a model's function" in result.message

    def newton(x, p):
        return p - x + 0 * tiltrim.trim(inner, **quick)["gap"]

    assert trimmed(scalar(newton), **quick)


def test_a_host_that_rounds_upwards_gets_the_same_numbers():
    libm = ctypes.CDLL("libm.so.6")
    upward = {"x86_64": 0x800, "aarch64": 0x400000}[platform.machine()]
    text = '[[condition]]\nname = "level"\nV = 15.0\ngamma_deg = 0.1\neta_deg = 7.3\n'

    def answers():
        trim = tiltrim.trim(tiltrim.parse_study(text).conditions["level"])
        linear = tiltrim.linearize(trim)
        lag = Model("lag", lambda x, u, p: u - x / 3, ["x"], ["u"])
        moved = tiltrim.simulate(lag, {"x": 1.0}, 0.5, lambda t: 0.1 * t)
        return [a.tobytes() for a in (trim.point.x, linear.A, linear.A_error, moved.x, moved.u)]

    nearest = answers()
    assert libm.fesetround(upward) == 0
    try:
        upwards = answers()
        assert libm.fegetround() == upward
    finally:
        libm.fesetround(0)
    assert upwards == nearest


def test_a_motion_of_a_study_without_a_trim_has_the_status_of_the_program():
    model = '[model]\nstate = [{name = "x", rate = "1 + x^2"}]\n[[condition]]\nname = "a"\n'
    flight = tiltrim.fly(tiltrim.parse_study(model + "[simulate]\nduration = 1\n", "s.toml"))
    assert flight.status == "no_trim" and not flight
