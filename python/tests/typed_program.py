"""A user's program for the type checker; it also runs."""

from typing import Dict

import numpy as np
from numpy.typing import NDArray

import tiltrim

Array = NDArray[np.float64]


def rates(x: Array, u: Array, p: Array) -> Array:
    return np.array([x[1], u[0] - p[0] * np.sin(x[0])])


pendulum = tiltrim.Model(
    "pendulum",
    rates,
    states=[("angle", "rad", 0.1), tiltrim.Signal("rate", "rad/s")],
    inputs=["torque"],
    parameters=[("stiffness", "1/s²")],
)
held: tiltrim.TrimResult = tiltrim.trim(
    pendulum, {"angle": 0.5, "stiffness": 4.0}, free=["torque"], steady=["rate"], implied=["angle"]
)
old = tiltrim.TrimSpec(free=["torque"], still=["rate"])
torque: float = held["torque"]
linear = tiltrim.linearize(pendulum, held.point)
A: Array = linear.A
found: tiltrim.Modes = tiltrim.modes(linear)
names: Dict[str, float] = held.point.as_dict()
branch = tiltrim.follow(held, parameter="angle", to=1.0)
angles: Array = branch["angle"]
motion = tiltrim.simulate(pendulum, held, 1.0, lambda t: [torque])
level = '[[condition]]\nname = "level"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n'
study = tiltrim.parse_study(level)
one: tiltrim.Modes = tiltrim.modes(study, condition="level")
each: Dict[str, tiltrim.TrimResult] = tiltrim.trim(study, starts=3)
assert one.verdict == "stable" and list(each) == ["level"]
assert abs(torque - 4 * np.sin(0.5)) < 1e-9
assert found.verdict == "undecided" and branch.end == "reached" and bool(motion)
