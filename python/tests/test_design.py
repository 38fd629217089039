"""lqr, place, lyapunov, hinf_norm, h2_norm: against SciPy, by signal name, and their docstrings."""

import doctest
import pickle

import numpy as np
import pytest

import tiltrim
import tiltrim._design

# A chemical reactor: Kautsky, Nichols, Van Dooren 1985, sec. 4, example 1.
A = np.array(
    [
        [1.380, -0.2077, 6.715, -5.676],
        [-0.5814, -4.290, 0, 0.6750],
        [1.067, 4.273, -6.654, 5.893],
        [0.0480, 4.273, 1.343, -2.104],
    ]
)
B = np.array([[0, 0], [5.679, 0], [1.136, -3.146], [1.136, 0]])


def test_the_examples_of_the_docstrings():
    found = doctest.testmod(tiltrim._design)
    assert found.attempted > 10 and found.failed == 0


def test_regulators_placements_and_covariances_are_scipys():
    linalg = pytest.importorskip("scipy.linalg")
    signal = pytest.importorskip("scipy.signal")
    Q, R = np.diag([1.0, 2, 3, 4]), np.array([[2.0, 0.5], [0.5, 1]])
    found = tiltrim.lqr((A, B), Q, R)
    assert found and found.residual < 1e-14
    np.testing.assert_allclose(found.S, linalg.solve_continuous_are(A, B, Q, R), rtol=1e-10)
    poles = [-0.2, -0.5, -5.0566, -8.6659]
    placed = tiltrim.place((A, B), poles)
    theirs = signal.place_poles(A, B, poles)
    assert placed
    np.testing.assert_allclose(np.sort(placed.poles.real), np.sort(theirs.computed_poles.real), rtol=1e-8)
    one = tiltrim.place((A, B[:, :1]), poles)  # of one input the gains are unique
    np.testing.assert_allclose(one.K, signal.place_poles(A, B[:, :1], poles).gain_matrix, rtol=1e-8)
    closed = A - B @ found.K
    noise = B @ B.T
    covariance = tiltrim.lyapunov(closed, noise)
    expected = linalg.solve_continuous_lyapunov(closed, -noise)
    np.testing.assert_allclose(covariance.X, expected, rtol=1e-10, atol=1e-12)
    C = np.eye(4)
    norm = tiltrim.h2_norm((closed, B, C, np.zeros((4, 2))))
    assert float(norm) == pytest.approx(np.sqrt(np.trace(expected)), rel=1e-10)


def swinging():
    model = tiltrim.Model(
        "swinging",
        lambda x, u, p: np.array([x[1], -4 * x[0] - 0.4 * x[1] + u[0] + 3 * u[1]]),
        states=[("angle", "rad"), ("rate", "rad/s")],
        inputs=["torque", "gust"],
    )
    return tiltrim.linearize(model, {"angle": 0.0, "rate": 0.0, "torque": 0.0, "gust": 0.0})


def test_signals_by_name():
    linear = swinging()
    found = tiltrim.lqr(linear, {"angle": 1.0}, {"torque": 2.0}, inputs=["torque"])
    assert found.inputs == ("torque",) and found.K.shape == (1, 2)
    matrices = (linear.A, linear.B[:, :1])
    np.testing.assert_allclose(found.K, tiltrim.lqr(matrices, [1, 0], [2]).K)
    assert tiltrim.place(linear, [-1, -2], inputs=["gust"]).K == pytest.approx(np.array([[-2 / 3, 2.6 / 3]]))
    peak = tiltrim.hinf_norm(linear, inputs=["gust"], outputs=["angle"])
    assert peak.gain == pytest.approx(3 / (2 * 0.1 * np.sqrt(0.99) * 4), rel=1e-6)
    assert tiltrim.hinf_norm(linear).gain > peak.gain
    assert tiltrim.h2_norm(linear, inputs=["gust"], outputs=["angle"]).norm == pytest.approx(
        3 / np.sqrt(4 * 0.1 * 8), rel=1e-6
    )
    assert tiltrim.lyapunov(linear, np.eye(2))
    with pytest.raises(ValueError, match="no input 'wind'; there are: torque, gust"):
        tiltrim.lqr(linear, [1, 1], [1], inputs=["wind"])
    with pytest.raises(ValueError, match="inputs: 'gust' is listed twice; expected each once"):
        tiltrim.lqr(linear, [1, 1], [1, 1], inputs=["gust", "gust"])
    with pytest.raises(ValueError, match="no signal 'q'; there are: angle, rate"):
        tiltrim.lqr(linear, {"q": 1}, [1, 1])
    with pytest.raises(TypeError, match=r"expected a LinearModel or \(A, B\)"):
        tiltrim.lqr(linear.A, [1, 1], [1])
    with pytest.raises(ValueError, match="R is not positive definite"):
        tiltrim.lqr(linear, [1, 1], [1, 0])


def test_results_in_words_and_pickled():
    plant = ([[3.0, 0], [0, -1]], [[0.0], [1]])
    results = [
        tiltrim.lqr(plant, [1, 1], [1]),
        tiltrim.place(plant, [-1, -2]),
        tiltrim.lyapunov(A, np.eye(4)),
        tiltrim.hinf_norm((*plant, [[1.0, 1]], [[0.0]])),
        tiltrim.h2_norm((*plant, [[1.0, 1]], [[0.0]])),
    ]
    starts = ["not_stabilizable\n  because of 3", "uncontrollable\n  poles", "solved: 4 x 4", "unstable: inf", "inf"]
    for one, words in zip(results, starts):
        assert repr(one).startswith(words)
        assert repr(pickle.loads(pickle.dumps(one))) == repr(one)
        assert "<div>" in one._repr_html_()
    assert [bool(one) for one in results[:4]] == [False, False, True, False]
