"""Models whose functions take many points at once: the same answers from fewer calls."""

import copy
import pickle

import numpy as np
import pytest
import tiltrim
from written_models import glider, glider_rates

LEVEL = tiltrim.TrimSpec(
    free=["theta", "throttle", "elevator"],
    steady=["V", "gamma", "q"],
    bounds={"theta": (-0.6, 0.6), "throttle": (0, 2), "elevator": (-0.5, 0.5)},
)
GUESS = {"V": 20.0, "theta": 0.05, "throttle": 0.3, "shift": 0.0}
QUICK = {"method": "newton", "starts": 0}


def counted(f):
    """f, and a list that receives the number of points of each call."""
    sizes = []

    def counting(x, u, p):
        sizes.append(x.shape[1] if x.ndim == 2 else 1)
        return f(x, u, p)

    return counting, sizes


def made(f, vectorized=True, **more):
    like = glider(False)
    return tiltrim.Model(
        "m", f, like.states, like.inputs, parameters=like.parameters, vectorized=vectorized, **more
    )


@pytest.mark.parametrize("derivatives", [None, "complex"])
def test_the_answers_are_those_of_one_point_at_a_time(derivatives):
    both = [glider(v, derivatives) for v in (True, False)]
    together, alone = (tiltrim.trim(m, GUESS, spec=LEVEL, **QUICK) for m in both)
    assert together and alone
    # steps are at round-off of unknowns of size one
    np.testing.assert_allclose(together.point.x, alone.point.x, rtol=0, atol=1e-13)
    np.testing.assert_allclose(together.point.u, alone.point.u, rtol=0, atol=1e-13)
    first, second = (tiltrim.linearize(m, alone.point) for m in both)
    # the same differences of the same values, but for the last bits of sin and cos of an array
    error = first.A_error + second.A_error
    assert np.all(abs(first.A - second.A) <= error)
    assert tiltrim.modes(first).verdict == tiltrim.modes(second).verdict


def test_differences_of_all_variables_are_one_call():
    f, sizes = counted(glider_rates)
    model = made(f)
    held = tiltrim.trim(model, GUESS, spec=LEVEL, **QUICK)
    sizes.clear()
    assert tiltrim.linearize(model, held.point)
    assert sorted(sizes) == [1, 1, 1, 1, 4 * 6]  # the point alone: twice before, twice after


def test_a_function_that_mixes_its_columns_is_refused():
    def mixing(x, u, p):
        return [*glider_rates(x, u, p)[:3], x[0] - x[0].mean()]

    with pytest.raises(tiltrim.InvalidArgument, match="treats each column of x, u and p"):
        tiltrim.trim(made(mixing), GUESS, spec=LEVEL, **QUICK)


@pytest.mark.parametrize(
    ("f", "words"),
    [
        (lambda x, u, p: x[:3], "expected 4 x 1 values, got 3 x 1"),
        (lambda x, u, p: list(x)[:3], "got 3 rows"),
        (lambda x, u, p: [x[0], x[1], x[2], np.zeros(7)], r"shape \(7,\) in row 4"),
        (lambda x, u, p: x[:, 0], r"got an array of shape \(4,\)"),
        (lambda x, u, p: None, "got None"),
        (lambda x, u, p: x + 1j, "expected real values, got complex ones"),
    ],
)
def test_wrong_shapes_are_named(f, words):
    with pytest.raises(tiltrim.InvalidArgument, match=words):
        tiltrim.trim(made(f), GUESS, spec=LEVEL, **QUICK)


def test_a_number_holds_for_all_points():
    model = tiltrim.Model(
        "m", lambda x, u, p: [x[1], 0.0], states=["a", "b"], vectorized=True
    )
    assert tiltrim.linearize(model, {"a": 1.0, "b": 0.0}).A.tolist() == [[0, 1], [0, 0]]


def test_exceptions_and_nan_are_as_of_one_point_at_a_time():
    def edge(x, u, p):
        if np.any(x < 0):
            raise LookupError("below the table")
        return [x[0] - 0.0]

    def root(x, u, p):
        with np.errstate(invalid="ignore"):
            return [np.sqrt(x[0]) ** 2]

    for f in (edge, root):
        together, alone = (
            tiltrim.linearize(tiltrim.Model("m", f, states=["x"], vectorized=v), {"x": 0.0})
            for v in (True, False)
        )
        assert (together.status, together.remarks) == (alone.status, alone.remarks)
        assert "edge of the model's domain" in together.remarks[0]
        assert type(together.exception) is type(alone.exception)

    def interrupted(x, u, p):
        if x.shape[1] > 1:
            raise KeyboardInterrupt
        return [-x[0]]

    with pytest.raises(KeyboardInterrupt):
        tiltrim.linearize(tiltrim.Model("m", interrupted, states=["x"], vectorized=True), {"x": 0.0})


def test_a_sweep_takes_eight_lines_at_a_time():
    pytest.importorskip("xarray")
    axes = {"shift": np.linspace(-0.2, 0.2, 8), "V": np.linspace(20, 30, 40)}
    maps, calls = [], []
    for vectorized in (True, False):
        f, sizes = counted(glider_rates)
        problem = tiltrim.Problem(made(f, vectorized, derivatives="complex"), GUESS, spec=LEVEL)
        maps.append(tiltrim.sweep(problem, axes=axes, crossings=False, **QUICK))
        calls.append(len(sizes))
    together, alone = maps
    assert np.all(together.status == "converged") and np.all(together.verdict == alone.verdict)
    # trims at round-off, simple eigenvalues of size 10 1/s
    np.testing.assert_allclose(together.eigenvalue, alone.eigenvalue, rtol=0, atol=1e-11)
    assert calls[0] < calls[1] / 8


def test_such_models_are_pickled_and_simulated():
    model = glider(True)
    again = pickle.loads(pickle.dumps(model))
    held = tiltrim.trim(again, GUESS, spec=LEVEL, **QUICK)
    assert held and copy.copy(again) is again
    ends = [
        tiltrim.simulate(m, held.point.replace(q=0.1), 1.0)["V"][-1] for m in (again, glider(False))
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
