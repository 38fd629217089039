"""The verbs on a user-defined model: numbers against closed forms."""

import importlib.util
import math
import re

import numpy as np
import pytest
from written_models import BALL, held_ball, magnet

import tiltrim
from tiltrim import Model, Problem

GAIN = 2 * 9.81 / 1.0  # of the ball at 10 mm and 1 A: d(rate')/di = -2 g/i, d(rate')/dz = 2 g/z


def test_trim_answers_the_current_that_holds_the_ball():
    held = tiltrim.trim(
        magnet(),
        {**BALL, "gap": 0.01, "current": 0.5},
        free=["current"],
        steady=["rate"],
        implied=["gap"],
        bounds={"current": (0, None)},
    )
    assert held and held.status == "converged" and held.equilibrium
    assert held["current"] == pytest.approx(0.01 * math.sqrt(0.1 * 9.81 / 9.81e-5), abs=1e-12)
    assert held.residual <= 1e-10 and held.exception is None
    assert held.rates.shape == (2,) and held.evaluations > 0


def test_limits_and_other_equilibria_are_told():
    parabola = Model("parabola", lambda x, u, p: [x[0] ** 2 - p[0]], states=["x"], parameters=["p"])
    asked = {"free": ["x"], "steady": ["x"]}
    both = tiltrim.trim(parabola, {"x": 1.0, "p": 4.0}, **asked, bounds={"x": (-5, 5)})
    assert sorted([both["x"], both.others[0]["x"]]) == pytest.approx([-2, 2], abs=1e-9)
    edge = tiltrim.trim(parabola, {"x": 1.0, "p": 4.0}, **asked, bounds={"x": (0, 2)})
    assert edge.limits_active == ["x upper"]
    none = tiltrim.trim(parabola, {"x": 1.0, "p": -1.0}, **asked, bounds={"x": (-5, 5)})
    assert none.status == "not_found" and not none and "x' = 1" in none.message


def test_limits_that_are_exceeded_are_not_called_reached():
    thrust = Model(
        "thrust", lambda x, u, p: [(u[0] - x[0] ** 2) / 10], states=["V"], inputs=["T"],
        outputs=[("load", "N")], h=lambda x, u, p: [2 * u[0]],
    )  # fmt: skip
    none = tiltrim.trim(
        thrust, {"V": 3.0, "T": 20.0}, free=["T"], steady=["V"],
        bounds={"T": (0, 40), "load": (-5, -1)},
    )  # fmt: skip
    assert none.limits_active == ["T lower"] and none["load"] == pytest.approx(0, abs=1e-6)
    assert "load 1 N above its upper limit -1 N" in none.message
    assert "1 above its upper limit -1" in repr(none)


def test_the_first_equilibrium_or_that_of_least_effort():
    calls = {"f": 0, "h": 0}

    def f(x, u, p):
        calls["f"] += 1
        return [(x[0] - 3) * (x[0] + 1)]

    def h(x, u, p):
        calls["h"] += 1
        return [x[0]]

    model = Model("two", f, states=["x"], outputs=["y"], h=h)
    first = tiltrim.trim(model, {"x": 2.0})  # no region to search, no effort
    assert first["x"] == pytest.approx(3, abs=1e-12) and not first.others and first.starts == 1
    assert calls["f"] <= 16 and calls["h"] <= 2
    for asked in ({"effort": ["x"]}, {"bounds": {"x": (-5, 5)}, "effort": ["x"]}, {"others": True}):
        least = tiltrim.trim(model, {"x": 2.0}, free=["x"], **asked)
        assert sorted([least["x"], *(o["x"] for o in least.others)]) == pytest.approx([-1, 3])
        assert least["x"] == pytest.approx(-1 if "effort" in asked else 3)
    again = tiltrim.trim(model, {"x": 2.0}, bounds={"x": (-5, 5)}, others=False, free=["x"])
    assert again["x"] == pytest.approx(3, abs=1e-12) and not again.others


@pytest.mark.parametrize("name", ["others", "closest", "starts", "tolerance"])
def test_an_option_of_the_wrong_type_is_named(name):
    with pytest.raises(TypeError, match=f"^{name} cannot be 'much'$"):
        tiltrim.trim(held_ball(), **{name: "much"})


def test_linearize_gives_the_matrix_and_its_error():
    linear = tiltrim.linearize(tiltrim.trim(held_ball()))
    assert linear and linear.method == "differences"
    expected = [[0, 1], [2 * 9.81 / 0.01 - GAIN * 200, -GAIN * 2]]
    np.testing.assert_array_less(abs(linear.A - expected), linear.A_error + 1e-12)
    assert linear.A_error.max() < 1e-4
    assert linear.B.shape == (2, 0) and linear.C.shape == (1, 2) and linear.D.shape == (1, 0)
    np.testing.assert_allclose(linear.C, [[200, 2]], atol=1e-6)
    plant = tiltrim.linearize(magnet(), {**BALL, "gap": 0.01, "current": 1.0}, inputs=["current"])
    np.testing.assert_allclose(plant.B, [[0], [-GAIN]], atol=1e-6)
    away = tiltrim.linearize(magnet(), {**BALL, "gap": 0.02, "current": 1.0})
    assert away.status == "not_equilibrium" and "rate" in away.message
    with pytest.raises(ValueError, match="no linear model"):
        tiltrim.modes(away)


def test_own_derivatives_are_taken_and_compared():
    def derivatives(x, u, p):
        return [[-p[0], 1.0, -x[0]]]

    linear = tiltrim.linearize(
        Model("m", lambda x, u, p: [u[0] - p[0] * x[0]], ["x"], ["u"], [], ["a"],
              derivatives=derivatives),
        {"x": 2.0, "u": 6.0, "a": 3.0},
    )
    assert linear.method == "exact" and linear.A[0, 0] == -3.0 and linear.B[0, 0] == 1.0
    assert linear.A_differences[0, 0] == pytest.approx(-3.0, abs=1e-8)
    wrong = Model("m", lambda x, u, p: -x, ["x"], derivatives=lambda x, u, p: [[2.0]])
    assert any("disagree" in r or "differ" in r for r in tiltrim.linearize(wrong, {}).remarks)
    bad = Model("m", lambda x, u, p: -x, ["x"], derivatives=lambda x, u, p: [2.0])
    with pytest.raises(ValueError, match=r"derivatives: expected 1 x 1 values, got an array of"):
        tiltrim.linearize(bad, {})
    bad = Model("m", lambda x, u, p: -x, ["x"], derivatives=lambda x, u, p: [[2.0, 1.0]])
    with pytest.raises(ValueError, match="'m': its derivatives: expected 1 x 1 values, got 1 x 2"):
        tiltrim.linearize(bad, {})


def test_derivatives_by_the_complex_step_are_exact():
    model = Model(
        "m", lambda x, u, p: [x[1], u[0] - p[0] * np.sin(x[0]) - x[1] * np.exp(x[0])],
        ["a", "r"], ["t"], ["y"], ["g"], h=lambda x, u, p: np.sqrt(x[0]) * p[0],
        derivatives="complex",
    )
    at = {"a": 0.3, "r": 0.0, "t": 9.81 * np.sin(0.3), "g": 9.81}
    assert model.exact
    linear = tiltrim.linearize(model, at)
    truth = [[0, 1], [-9.81 * np.cos(0.3), -np.exp(0.3)]]
    assert linear.method == "exact" and not linear.remarks and linear.A_error.max() < 1e-12
    np.testing.assert_allclose(linear.A, truth, rtol=1e-14)
    np.testing.assert_allclose(linear.C, [[9.81 / 2 / np.sqrt(0.3), 0]], rtol=1e-14)


def test_a_wrong_complex_step_that_is_right_at_the_guess_is_refused():
    """The slope of V |V| is 0 at V = 0, by the complex step too."""
    drag = Model(
        "drag", lambda x, u, p: [u[0] - x[0] * abs(x[0])], ["V"], ["T"], derivatives="complex"
    )
    with pytest.raises(ValueError, match="by the complex step and"):
        tiltrim.trim(drag, {"V": 0, "T": 4})


@pytest.mark.filterwarnings("ignore:Casting complex")
@pytest.mark.parametrize("f, words", [
    (lambda x, u, p: x + 3 * abs(x), "is 1 by the complex step and 4 by differences: a function"),
    (lambda x, u, p: x.real, "is 0 by the complex step and 1 by differences"),
    (lambda x, u, p: np.conj(x), "is -1 by the complex step and 1 by differences"),
    (lambda x, u, p: np.array([np.sin(x[0])]).astype(float), "is 0 by the complex step and"),
    (lambda x, u, p: np.arctan2(x, 1.0), r"it takes no complex numbers \(TypeError"),
])
def test_what_loses_imaginary_parts_is_refused(f, words):
    model = Model("m", f, ["x"], derivatives="complex")
    with pytest.raises(ValueError, match="model 'm': its derivatives: .*" + words):
        tiltrim.linearize(model, {"x": 1.5}, tolerance=1e9)


def test_modes_of_a_loop_and_of_a_bare_matrix():
    found = tiltrim.modes(held_ball())
    frequency = math.sqrt(GAIN * 200 - 1962)  # λ² + (2g/i) k_d λ + (2g/i) k_p - 2g/z = 0
    assert found.verdict == "stable" and found
    np.testing.assert_allclose(found.frequency, frequency, rtol=1e-7)
    np.testing.assert_allclose(found.damping, GAIN / frequency, rtol=1e-7)
    bare = tiltrim.modes([[0, 1], [-4, -2]], states=["z", "v"])
    np.testing.assert_allclose(bare.eigenvalues, [-1 - 3**0.5 * 1j, -1 + 3**0.5 * 1j], rtol=1e-14)
    assert bare.states == ("z", "v") and len(bare) == 2
    for i, mode in enumerate(bare.modes):
        assert mode is bare[i] and type(mode.eigenvalue) is complex and mode.determined is True
        assert mode.eigenvalue == bare.eigenvalues[i] and mode.error == bare.error[i]
        assert (mode.frequency, mode.damping) == (bare.frequency[i], bare.damping[i])
        assert mode.name == bare.names[i] == "z + v" and type(mode.error) is float
        np.testing.assert_allclose(np.vdot(mode.left, mode.right), 1, rtol=1e-14)
        np.testing.assert_allclose(mode.participation, [0.5, 0.5], rtol=1e-14)
    doubtful = tiltrim.modes([[0.01]], error=[[0.1]])
    assert doubtful.verdict == "undecided"
    for wrong in ([[1, 2]], [[1j]], [[math.nan]], 3.0, "A"):
        with pytest.raises(ValueError):
            tiltrim.modes(wrong)


def test_a_model_without_states_is_its_d_and_has_no_modes():
    gain = Model("gain", None, inputs=["u"], outputs=["y"], h=lambda x, u, p: [2 * u[0] ** 2])
    rates, outputs = gain.evaluate({"u": 3.0})
    assert rates.shape == (0,) and outputs.tolist() == [18.0]
    linear = tiltrim.linearize(gain, {"u": 3.0})
    assert linear and linear.A.shape == (0, 0) and linear.B.shape == (0, 1)
    assert linear.C.shape == (1, 0) and "0 states" in repr(linear)
    assert linear.D[0, 0] == pytest.approx(12.0, abs=linear.D_error[0, 0])
    with pytest.raises(ValueError, match="the trim has no conditions"):
        tiltrim.trim(gain, {"u": 3.0})
    with pytest.raises(ValueError, match="no function f"):
        Model("no rates", None, states=["x"])
    for none in (tiltrim.modes(linear), tiltrim.modes(np.zeros((0, 0)))):
        assert none.verdict == "stable" and len(none) == 0
        assert none.spectral_abscissa == -math.inf and "no states, no modes" in repr(none)
    assert re.search(r"0\.0000 +- +inf", repr(tiltrim.modes([[0.0]])))  # zero has no damping ratio


def test_numbers_of_any_size_are_printed_short():
    for largest in (1e10, 1e300):
        text = repr(tiltrim.modes([[largest]]))
        assert f"{largest:g}" in text and max(map(len, text.splitlines())) < 100


def test_follow_locates_fold_and_hopf():
    fold = Model("fold", lambda x, u, p: [p[0] + x[0] ** 2], states=["x"], parameters=["mu"])
    branch = tiltrim.follow(fold, {"x": -1.0, "mu": -1.0}, "mu", 1.0, free=["x"], steady=["x"])
    assert branch.events[0].kind == "fold"
    assert branch.events[0].parameter == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(branch["x"] ** 2, -branch.values, atol=1e-9)

    def normal_form(x, u, p):
        r2 = x @ x
        return [(p[0] - r2) * x[0] - x[1], x[0] + (p[0] - r2) * x[1]]

    hopf = Model("Hopf", normal_form, states=["x", "y"], parameters=["mu"])
    start = tiltrim.trim(hopf, {"mu": -1.0}, free=["x", "y"], steady=["x", "y"])
    branch = tiltrim.follow(start, parameter="mu", to=1.0)
    assert branch.end == "reached" and branch.events[-1].parameter == 1.0
    event = branch.events[0]
    assert event.kind == "hopf" and event.parameter == pytest.approx(0, abs=1e-9)
    assert abs(event.eigenvalue.imag) == pytest.approx(1, abs=1e-9)
    assert set(branch.unstable.tolist()) == {0, 2}
    assert branch.point(0)["mu"] == -1.0
    with pytest.raises(ValueError, match="no signal 'nu'"):
        tiltrim.follow(start, parameter="nu", to=1.0)


def test_sweep_finds_the_gain_from_which_on_the_ball_is_held():
    pytest.importorskip("xarray")
    ds = tiltrim.sweep(held_ball(), axes={"k_p": [40, 80, 120, 160, 200]})
    assert ds.verdict.values.tolist() == ["unstable"] * 2 + ["stable"] * 3
    assert set(ds.status.values) == {"converged"}
    assert ds.sizes["crossing"] == 1
    assert ds.crossing_at.values[0, 0] == pytest.approx(100, abs=1e-6)  # k_p = i/z
    assert ds.interval_verdict.values.tolist() == ["unstable", "stable"]
    assert ds.eigenvalue.dtype == complex and ds.eigenvalue.dims == ("k_p", "mode")
    for k_p in ds.k_p.values:
        roots = np.roots([1, GAIN * 2, GAIN * k_p - 1962])
        own = ds.eigenvalue.sel(k_p=k_p).values
        np.testing.assert_allclose(np.sort_complex(own), np.sort_complex(roots), rtol=1e-6)
    assert ds.k_p.attrs["units"] == "A m-1" and ds.k_p.attrs["study_unit"] == "A/m"
    assert ds.state_value.sel(state="gap").values == pytest.approx([0.01] * 5, abs=1e-9)


def test_sweeps_of_several_problems_and_axes():
    pytest.importorskip("xarray")
    problems = [held_ball(), Problem(held_ball().model, held_ball().guess.replace(mass=0.2),
                                     name="heavy", spec=held_ball().spec)]  # fmt: skip
    ds = tiltrim.sweep(problems, axes={"k_p": [150, 200], "k_d": [1.0, 2.0, 3.0]}, crossings=False)
    assert ds.status.dims == ("condition", "k_p", "k_d") and ds.status.shape == (2, 2, 3)
    assert ds.condition.values.tolist() == ["10 mm", "heavy"]
    assert ds.sizes["crossing"] == 0
    together = tiltrim.sweep(held_ball(), axes={"both": {"k_p": [100, 200], "k_d": [1.0, 2.0]}})
    assert together.status.dims == ("both",) and together.k_d.values.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="2 threads for a model with Python callables"):
        tiltrim.sweep(held_ball(), axes={"k_p": [1, 2]}, threads=2)
    for wrong in ([], "k", [1j], [[1.0]]):
        with pytest.raises(ValueError, match="axis 'k_p': expected a list of numbers"):
            tiltrim.sweep(held_ball(), axes={"k_p": wrong})


def test_tune_finds_where_both_eigenvalues_meet():
    best = tiltrim.tune(
        held_ball(), gains={"k_d": (0.5, 20.0)}, limits={"frequency": 500}, evaluations=1000
    )
    frequency = math.sqrt(GAIN * 200 - 1962)
    assert best and best.status == "tuned"
    assert best["k_d"] == pytest.approx(2 * frequency / GAIN, rel=1e-4)
    assert best.goal == pytest.approx(frequency, rel=1e-4)
    limit = [a for a in best.achieved if not a.goal][0]
    assert (limit.measure, limit.limit) == ("frequency", 500.0) and limit.reserve > 0
    unmet = tiltrim.tune(held_ball(), gains={"k_d": (0.5, 20.0)}, limits={"decay": 60},
                         evaluations=300)  # fmt: skip
    assert unmet.status == "limits_unmet" and not unmet and "decay" in unmet.message
    with pytest.raises(ValueError, match="no measure 'dampng' .nearest: 'damping'"):
        tiltrim.tune(held_ball(), gains={"k_d": (1, 2)}, goal="dampng")


def test_simulate_estimates_its_error_where_a_function_gives_the_input():
    swing = Model("swing", lambda x, u, p: [x[1], -np.sin(x[0]) + u[0]], ["a", "b"], ["u"])
    drive = lambda t: 0.2 * math.sin(t)  # noqa: E731
    run, exact = (
        tiltrim.simulate(swing, {"a": 2.0}, 20.0, drive, tolerance=tolerance)
        for tolerance in (1e-6, 1e-12)
    )
    off = np.abs(run.x - exact.x).max(axis=0)
    assert run and (off > 1e-7).all() and np.allclose(run.error, off, rtol=0.1)
    at_steps = tiltrim.simulate(swing, {"a": 2.0}, 20.0, drive, tolerance=1e-6, sample=0)
    assert at_steps and np.isfinite(at_steps.error).all()
    lorenz = Model(
        "Lorenz",
        lambda x, u, p: [10 * (x[1] - x[0]), x[0] * (28 - x[2]) - x[1], x[0] * x[1] - 8 / 3 * x[2]],
        ["x", "y", "z"],
        ["u"],
    )
    chaos = tiltrim.simulate(lorenz, {"x": 1.0, "z": 20.0}, 60.0, lambda t: 0.0, tolerance=1e-6)
    assert chaos.status == "inaccurate" and 10 < chaos.t[-1] < 50


def test_the_error_of_a_motion_that_ends_early_is_that_of_its_end():
    m = Model("m", lambda x, u, p: [x[0]], states=["x"], inputs=["u"])
    for drive in (None, lambda t: 0.0):
        motion = tiltrim.simulate(m, {"x": 1.0}, 800, drive, sample=50.0)
        assert motion.status == "diverged" and len(motion) == 2
        off = abs(motion["x"][-1] - math.exp(motion.t[-1]))
        assert off > 1 and motion.error[0] == pytest.approx(off, rel=0.1)


def test_samples_lie_on_the_grid_and_the_end_is_no_second_one():
    m = Model("m", lambda x, u, p: [-x[0]], states=["x"], inputs=["u"])
    for duration, sample, count in ((1.0, 1 / 49, 50), (1e-5, 1e-6, 11)):
        for drive in (None, lambda t: 0.0):
            motion = tiltrim.simulate(m, {"x": 1.0}, duration, drive, sample=sample)
            assert len(motion) == count and motion.t[-1] == duration
            assert (motion.t[:-1] == np.arange(count - 1) * sample).all()


def test_a_motion_that_slides_along_a_switch_says_so():
    m = Model(
        "relay",
        lambda x, u, p: [x[1], -2 * np.sign(x[0] + x[1]) + u[0]],
        ["x", "v"],
        ["u"],
        switches={"the relay": lambda x, u, p: x[0] + x[1]},
    )
    for drive in (None, lambda t: 0.0):
        motion = tiltrim.simulate(m, {"x": 1.0}, 5.0, drive, max_steps=3_000)
        assert not motion and motion.t[-1] == pytest.approx(2**0.5 - 1, abs=1e-3)
        assert "the motion slides along 'the relay'" in motion.message


def test_a_flight_estimates_the_error_of_its_end():
    def flown(tolerance):
        text = level + f"[simulate]\nstart = \"level\"\nduration = 5\ntolerance = {tolerance}\n"
        text += '[[simulate.disturbance]]\nkind = "step"\non = "V"\nat = 1.0\nsize = 1.0\n'
        return tiltrim.fly(tiltrim.parse_study(text))

    level = '[[condition]]\nname = "level"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n'
    flight, exact = flown(1e-7), flown(1e-13)
    assert set(flight.error) == set(flight.columns)
    for name in ("V", "theta_deg", "height", "distance"):
        off = abs(flight[name][-1] - exact[name][-1])
        assert off / 3 <= flight.error[name] <= 3 * off


def test_simulate_follows_the_exact_motion():
    decay = Model("decay", lambda x, u, p: [u[0] - x[0]], states=["x"], inputs=["u"], outputs=["y"],
                  h=lambda x, u, p: 2 * x)  # fmt: skip
    free = tiltrim.simulate(decay, {"x": 1.0}, 2.0)
    np.testing.assert_allclose(free["x"], np.exp(-free.t), rtol=1e-8)
    np.testing.assert_array_equal(free["y"], 2 * free["x"])
    step = tiltrim.simulate(decay, {"x": 0.0}, 3.0, {"u": 2.0})
    np.testing.assert_allclose(step["x"], 2 * (1 - np.exp(-step.t)), atol=1e-8)
    ramp = tiltrim.simulate(decay, {"x": 0.0}, 3.0, lambda t: t)
    np.testing.assert_allclose(ramp["x"], ramp.t - 1 + np.exp(-ramp.t), atol=1e-8)
    np.testing.assert_array_equal(ramp["u"], ramp.t)
    pulse = tiltrim.simulate(decay, {}, 2.0, lambda t: 1.0 if t < 1 else 0.0, breaks=[1.0])
    late = pulse.t > 1
    np.testing.assert_allclose(
        pulse["x"][late], (1 - math.exp(-1)) * np.exp(1 - pulse.t[late]), rtol=1e-7
    )
    changed = tiltrim.simulate(decay, {}, 2.0, changes=[("u", 1.0, 0.0, 1.0)])
    np.testing.assert_allclose(changed["x"][-1], pulse["x"][-1], rtol=1e-7)
    assert free and free.status == "completed" and len(free) == len(free.t)
    burst = tiltrim.simulate(Model("pole", lambda x, u, p: x * x, ["x"]), {"x": 1.0}, 2.0)
    assert not burst and burst.t[-1] == pytest.approx(1.0, abs=1e-3)  # 1/(1 - t)
    with pytest.raises(ValueError, match="no input 'v'; the model has: u"):
        tiltrim.simulate(decay, {}, 1.0, {"v": 1.0})
    with pytest.raises(ValueError, match="the input: expected 1 values, got 2"):
        tiltrim.simulate(decay, {}, 1.0, lambda t: [1.0, 2.0])


def test_switches_are_met_on_the_way():
    bounce = Model("m", lambda x, u, p: [1.0 if x[0] < 0.5 else 2.0 + u[0] * 0], ["x"], ["u"],
                   switches={"gear": lambda x, u, p: x[0] - 0.5})  # fmt: skip
    for drive in (None, lambda t: [0.0]):
        motion = tiltrim.simulate(bounce, {}, 1.0, drive)
        assert [(e.name, e.rising) for e in motion.events] == [("gear", True)]
        assert motion.events[0].t == pytest.approx(0.5, abs=1e-12)
        assert motion["x"][-1] == pytest.approx(0.5 + 2 * 0.5, abs=1e-6)  # across the jump
    with pytest.raises(ValueError, match="'x' is a state; expected an input or a parameter"):
        tiltrim.simulate(bounce, {}, 1.0, changes=[("x", 1.0)])


def test_outputs_that_raise_are_nan():
    def height(x, u, p):
        if x[0] > 0.45:
            raise ValueError("above the table")
        return [2 * x[0]]

    m = Model("m", lambda x, u, p: [u[0]], ["x"], ["u"], ["y"], h=height)
    for drive in ({"u": 1.0}, lambda t: [1.0]):
        motion = tiltrim.simulate(m, {}, 1.0, drive)
        assert motion and "ValueError: above the table" in motion.message
        np.testing.assert_allclose(motion["y"], np.where(motion.t < 0.45, 2 * motion.t, np.nan))
        assert isinstance(motion.exception, ValueError)


def test_other_packages_get_their_own_objects():
    signal = pytest.importorskip("scipy.signal")
    linear = tiltrim.linearize(tiltrim.tiltrotor())
    system = linear.to_scipy()
    assert isinstance(system, signal.StateSpace)
    np.testing.assert_array_equal(system.A, linear.A)
    np.testing.assert_array_equal(system.D, linear.D)
    without = tiltrim.linearize(
        Model("m", lambda x, u, p: u - x, states=["x"], inputs=["u"]), {}
    ).to_scipy()
    np.testing.assert_array_equal(without.C, [[1.0]])


def test_what_python_control_is_asked(monkeypatch):
    import sys
    import types

    asked = {}
    stand_in = types.SimpleNamespace(ss=lambda *matrices, **names: asked.update(names, m=matrices))
    monkeypatch.setitem(sys.modules, "control", stand_in)
    linear = tiltrim.linearize(tiltrim.tiltrotor())
    linear.to_control()
    for own, given in zip((linear.A, linear.B, linear.C, linear.D), asked.pop("m")):
        np.testing.assert_array_equal(own, given)
    assert asked == {
        "states": [s.name for s in linear.states],
        "inputs": ["V", "gamma", "eta"],
        "outputs": [s.name for s in linear.outputs],
    }


# Debian has no package of python-control: the test above has a stand-in, this one the real thing.
if importlib.util.find_spec("control"):

    def test_python_control_gets_the_names():
        linear = tiltrim.linearize(tiltrim.tiltrotor())
        system = linear.to_control()
        np.testing.assert_array_equal(system.A, linear.A)
        assert system.state_labels == [s.name for s in linear.states]
        assert system.input_labels == ["V", "gamma", "eta"]
        assert system.output_labels == [s.name for s in linear.outputs]


def test_a_missing_package_is_named(monkeypatch):
    import sys

    linear = tiltrim.linearize(tiltrim.trim(held_ball()))
    branch = tiltrim.follow(held_ball(), parameter="k_p", to=210)
    for package, use in (
        ("control", linear.to_control),
        ("scipy.signal", linear.to_scipy),
        ("xarray", branch.to_xarray),
        ("xarray", lambda: tiltrim.sweep(held_ball(), axes={"k_p": [150]})),
    ):
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(ImportError, match=f"needs the package '{package.split('.')[0]}'"):
            use()


def test_branches_and_motions_as_datasets():
    pytest.importorskip("xarray")
    branch = tiltrim.follow(held_ball(), parameter="k_p", to=150)
    ds = branch.to_xarray()
    np.testing.assert_array_equal(ds.k_p, branch.values)
    np.testing.assert_array_equal(ds.state_value.sel(state="gap"), branch["gap"])
    np.testing.assert_array_equal(ds.output_value.sel(output="current"), branch["current"])
    assert ds.event_kind.values[-1] == "end" and ds.attrs["end"] == branch.end
    motion = tiltrim.simulate(held_ball().model, held_ball().guess.replace(gap=0.0101), 0.5)
    ds = motion.to_xarray()
    np.testing.assert_array_equal(ds.gap, motion["gap"])
    assert ds.gap.attrs["units"] == "m" and ds.time.attrs["units"] == "s"
