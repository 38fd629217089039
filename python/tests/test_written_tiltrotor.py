"""The tiltrotor written in Python from docs/model.md agrees with the built-in one to 1e-9."""

import numpy as np
import pytest

import tiltrim

pytest.importorskip("scipy")
from written_models import tiltrotor_like  # noqa: E402

CONDITIONS = [(2.0, 90.0, 90.0), (6.0, 45.0, 45.0), (15.0, 0.0, 0.0), (4.0, 70.0, 80.0)]


def test_rates_and_outputs_over_random_points():
    condition = tiltrim.tiltrotor()
    model, guess = condition.model, condition.guess
    written = tiltrotor_like(model)
    random = np.random.default_rng(1)
    largest = 0.0
    for _ in range(1000):
        x = random.uniform(-1, 1, 6) * [1.5, 3.0, 3.0, 1.0, 2.0, 20.0]
        p = guess.p * random.uniform(0.7, 1.3, guess.p.size)
        p[:3] = random.uniform([3.0, -1.5, 0.0], [20.0, 1.5, 1.6])
        p[-10] = random.choice([0.0, 0.4])  # aircraft.cyclic_blend
        at = tiltrim.Point(model, x, None, p)
        for own, theirs in zip(written.evaluate(at), model.evaluate(at)):
            largest = max(largest, np.max(abs(own - theirs) / (1 + abs(theirs))))
    assert largest < 1e-9
    assert at.keys()[6 + p.size - 10] == "aircraft.cyclic_blend"


@pytest.mark.parametrize("V, gamma_deg, eta_deg", CONDITIONS)
def test_trims_and_eigenvalues(V, gamma_deg, eta_deg):
    condition = tiltrim.tiltrotor(V, gamma_deg, eta_deg)
    held = tiltrim.trim(condition)
    assert held
    theirs = tiltrim.modes(held)
    for exact in (False, True):
        written = tiltrotor_like(condition.model, exact)
        own = tiltrim.trim(written, condition.guess, spec=condition.spec)
        assert own
        np.testing.assert_allclose(own.point.x, held.point.x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(own.outputs, held.outputs, rtol=1e-9, atol=1e-9)
        found = tiltrim.modes(own)
        assert found.verdict == theirs.verdict
        miss = abs(found.eigenvalues - theirs.eigenvalues)
        if exact:
            assert miss.max() < 1e-9
        else:  # by differences, which say how good they are
            assert np.all(miss <= found.error + theirs.error)
            assert miss.max() < 1e-6


def test_a_sweep_of_it():
    pytest.importorskip("xarray")
    condition = tiltrim.tiltrotor()
    values = [0.4, 0.75, 1.5]
    theirs = tiltrim.sweep(condition, axes={"gains.K_Lp": values}, crossings=False)
    written = tiltrotor_like(condition.model, exact=True)
    own = tiltrim.sweep(
        written, condition.guess, spec=condition.spec, axes={"gains.K_Lp": values}, crossings=False
    )
    assert (own.verdict.values == theirs.verdict.values).all()
    for mine, built_in in zip(own.eigenvalue.values, theirs.eigenvalue.values):
        miss = abs(np.sort_complex(mine) - np.sort_complex(built_in))
        assert miss.max() < 1e-9
