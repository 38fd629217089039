"""qualities: against the program, and of any linear model."""

from pathlib import Path

import numpy as np
import pytest
import tiltrim

STUDY = Path(__file__).resolve().parents[2] / "studies/boeing747.toml"
ROLES = {
    "pitch": "theta", "pitch_rate": "q", "downward_speed": "w", "speed": "u", "stick": "elevator",
}  # fmt: skip


def test_the_same_as_the_program(program):
    found = tiltrim.qualities(STUDY, condition="cruise")
    theirs = program("qualities", STUDY)["conditions"][0]["qualities"]
    assert found.data == theirs
    assert found and found.level == 1
    assert found["phugoid damping"].border == "1|2"
    assert "level 1" in repr(found)
    with pytest.raises(ValueError, match="phugoid damping"):
        found["phugoid"]


def test_a_linear_model_with_roles(program):
    linear = tiltrim.linearize(STUDY, condition="cruise")
    found = tiltrim.qualities(
        linear, ROLES, aircraft="III", airspeed=774.0, gravity=32.2, category="C"
    )
    assert found.level == 2
    assert found["control anticipation"].level == 2
    damping = -np.cos(np.angle(np.linalg.eigvals(linear.A)))
    assert np.isclose(damping, found["short-period damping"].value, rtol=1e-9).any()
    with pytest.raises(ValueError, match="no role 'stik'"):
        tiltrim.qualities(linear, {"pitch": "theta", "pitch_rate": "q", "stik": "elevator"})
    with pytest.raises(ValueError, match="expected one of A, B, C"):
        tiltrim.qualities(linear, ROLES, category="D")
    for wrong in (-3.0, 0.0, np.nan, np.inf):
        for name in ("airspeed", "gravity", "n_per_alpha"):
            with pytest.raises(ValueError, match=f"{name}: expected a number above 0, got {wrong}"):
                tiltrim.qualities(linear, ROLES, **{name: wrong})
    with pytest.raises(TypeError, match="airspeed: expected a number, got '9'"):
        tiltrim.qualities(linear, ROLES, airspeed="9")
    with pytest.raises(TypeError, match="roles"):
        tiltrim.qualities(linear)
    hover = tiltrim.qualities(
        linear, ROLES, phase="hover", airspeed=774.0, bandwidth=[[(0.0, 0.1)], [(0.0, 0.05)]]
    )
    assert hover["attitude bandwidth"].level == 1
