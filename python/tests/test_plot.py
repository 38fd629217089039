"""Frequency responses against closed forms and SciPy, data frames, pictures, trims as arguments."""

import math

import numpy as np
import pytest
import tiltrim

OMEGA = np.geomspace(0.1, 100, 31)


def second_order():
    """x'' + 2 ζ ω x' + ω² x = ω² u with ω = 3 rad/s, ζ = 0.2."""
    model = tiltrim.Model(
        "oscillator",
        lambda x, u, p: [x[1], 9 * (u[0] - x[0]) - 1.2 * x[1]],
        states=[("x", "m"), ("v", "m/s")],
        inputs=[("u", "N")],
        outputs=[("force", "N")],
        parameters=["k"],
        h=lambda x, u, p: [u[0] - x[0]],
        derivatives=lambda x, u, p: [[0, 1, 0, 0], [-9, -1.2, 9, 0], [-1, 0, 1, 0]],
    )
    return tiltrim.Problem(model, {"k": 1.0}, free=["x", "v"], steady=["x", "v"])


def level():
    return tiltrim.tiltrotor(V=15.0)


def test_bode_is_the_closed_form_and_scipys():
    s = 1j * OMEGA
    expected = 9 / (s**2 + 1.2 * s + 9)
    to_state = tiltrim.bode(second_order(), "u", "x", OMEGA)
    assert np.allclose(to_state.response, expected, rtol=1e-13)
    assert to_state.unit == "m/N"
    assert tiltrim.bode(second_order(), "u", "x", OMEGA[0]).response == to_state.response[:1]
    to_output = tiltrim.bode(second_order(), "u", "force", OMEGA)  # D is not zero
    assert np.allclose(to_output.response, 1 - expected, rtol=1e-12)
    assert to_output.unit == ""
    assert np.allclose(to_state.phase[[0, -1]], [0, -np.pi], atol=0.03)
    signal = pytest.importorskip("scipy.signal")
    linear = tiltrim.linearize(level())
    system = signal.StateSpace(linear.A, linear.B[:, :1], linear.C[:1], linear.D[:1, :1])
    _, theirs = signal.freqresp(system, OMEGA)
    ours = tiltrim.bode(linear, linear.inputs[0].name, linear.outputs[0].name, OMEGA)
    assert np.allclose(ours.response, theirs, rtol=1e-8)


@pytest.mark.parametrize(
    "arguments",
    [
        ("w", "x"), ("u", "y"), ("u", "x", []), ("u", "x", [2.0, 1.0]), ("u", "x", [0.0, 1.0]),
        ("u", "x", math.nan), ("u", "x", math.inf), ("u", "x", [1.0, math.inf]),
    ],
)  # fmt: skip
def test_bode_refuses_names_and_frequencies_that_are_none(arguments):
    with pytest.raises(tiltrim.InvalidArgument):
        tiltrim.bode(second_order(), *arguments)


def test_bode_names_a_pole_on_the_axis():
    m = tiltrim.Model("m", lambda x, u, p: [x[1], -x[0] + u[0]], ["x", "v"], ["u"])
    linear = tiltrim.linearize(m, {"x": 0.0})
    with pytest.raises(tiltrim.InvalidArgument, match="a pole lies at 1 rad/s, where"):
        tiltrim.bode(linear, "u", "x", [0.5, 1.0])
    assert tiltrim.bode(linear, "u", "x", 0.5).magnitude[0] == pytest.approx(1 / 0.75)
    assert np.isfinite(tiltrim.bode(linear, "u", "x").response).all()


def test_data_frames_hold_the_columns():
    pytest.importorskip("pandas")
    branch = tiltrim.follow(level(), parameter="V", to=14.0)
    frame = branch.to_dataframe()
    assert len(frame) == len(branch) and np.array_equal(frame["theta"], branch["theta"])
    motion = tiltrim.simulate(second_order().model, {"x": 1.0, "k": 1.0}, 2.0)
    frame = motion.to_dataframe()
    assert np.array_equal(frame.index, motion.t) and np.array_equal(frame["x"], motion["x"])


def test_pictures_have_labelled_axes():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    xr = pytest.importorskip("xarray")
    assert xr
    branch = tiltrim.follow(level(), parameter="V", to=14.0)
    motion = tiltrim.simulate(second_order().model, {"x": 1.0, "k": 1.0}, 2.0)
    line = tiltrim.sweep(level(), axes={"gains.K_Lp": [0.5, 1.0, 2.0]})
    plane = tiltrim.sweep(level(), axes={"V": [12.0, 15.0], "gains.K_Lp": [0.5, 1.0]})
    for drawn, labels in (
        (tiltrim.modes(level()).plot(), [("Re λ [1/s]", "Im λ [rad/s]")]),
        (branch.plot("theta"), [("V [m/s]", "theta [rad]")]),
        (motion.plot("x", "v"), [("", "x [m]"), ("time [s]", "v [m/s]")]),
        (
            tiltrim.bode(second_order(), "u", "x").plot(),
            [("", "|x/u| [m/N]"), ("frequency [rad/s]", "phase [°]")],
        ),
        (tiltrim.plot(line), [("K_Lp", "Re λ [1/s]")]),
        (
            tiltrim.margins(level()).plot(),
            [("", "|L|"), ("frequency [rad/s]", "phase of L [°]")],
        ),
        (
            tiltrim.margins(level())["delta_e"].plot(),
            [("", "|L|"), ("frequency [rad/s]", "phase of L [°]")],
        ),
        (tiltrim.envelope(level(), count=7).plot(), [("V [m/s]", "eta_deg [degrees]")]),
        (tiltrim.all_equilibria(level(), starts=5).plot(), [("Re λ [1/s]", "Im λ [rad/s]")]),
        (tiltrim.plot(plane), [("K_Lp", "V [m/s]")]),
    ):
        panels = np.atleast_1d(drawn)
        assert [(p.get_xlabel(), p.get_ylabel()) for p in panels] == labels
        assert all(p.lines or p.collections for p in panels)
    unstable = tiltrim.sweep(level(), axes={"gains.k_de": [-4.0, 3.9]})
    assert tiltrim.plot(unstable).collections  # the shaded stretch
    pyplot.close("all")
    with pytest.raises(TypeError, match="LinearModel"):
        tiltrim.plot(tiltrim.linearize(level()))
    with pytest.raises(tiltrim.InvalidArgument, match="no"):
        motion.plot("y")


def test_every_verb_takes_a_trim():
    held = tiltrim.trim(second_order())
    assert tiltrim.trim(held).point.as_dict() == held.point.as_dict()
    assert tiltrim.modes(tiltrim.linearize(held)).verdict == "stable"
    assert len(tiltrim.follow(held, parameter="k", to=2.0)) > 1
    assert tiltrim.simulate(held.model, held, 0.1).status == "completed"
    assert tiltrim.sensitivities(held, parameters=["k"])
    pytest.importorskip("xarray")
    assert tiltrim.sweep(held, axes={"k": [1.0, 2.0]}).verdict.values.tolist() == ["stable"] * 2
    of_condition = tiltrim.trim(level())
    tuned = tiltrim.tune([of_condition], gains={"gains.K_Lp": (0.5, 2.0)}, evaluations=10)
    assert tuned.evaluations > 0
