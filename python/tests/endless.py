"""endless.py VERB: runs a verb on Python callables that never finish, prints "running" once a
callable has been entered, and then how it ended."""

import sys

import numpy as np
from written_models import held_ball, magnet, magnet_law

import tiltrim

begun = False


def say():
    global begun
    if begun:
        print("running")
        begun = False


def nowhere(x, u, p):
    """A model without an equilibrium, for which the search does not end."""
    say()
    return [p[0] + x[0] ** 2]


def law(x, u, p):
    say()
    return [p[0] + p[2] * (u[0] - p[1]) + p[3] * u[1]]


m = tiltrim.Model("m", nowhere, states=["x"], parameters=["p"])
own = magnet_law()
hold = tiltrim.Model("law", None, inputs=own.inputs, outputs=own.outputs,
                     parameters=own.parameters, h=law)  # fmt: skip
ball = held_ball()
loop = tiltrim.Problem(
    tiltrim.close_loop(magnet(), hold), ball.guess.as_dict(), spec=ball.spec, name="10 mm"
)
asked = {"free": ["x"], "steady": ["x"], "bounds": {"x": (-9, 9)}}
guess = {"p": 1.0}
VERBS = {
    "trim": lambda: tiltrim.trim(m, guess, starts=10**9, **asked),
    "newton": lambda: tiltrim.trim(m, guess, starts=10**9, method="newton", **asked),
    "sweep": lambda: tiltrim.sweep(
        m, guess, axes={"p": np.linspace(1, 2, 50)}, starts=10**9, **asked
    ),
    "tune": lambda: tiltrim.tune(
        loop, gains={"k_d": (0.5, 20.0), "k_p": (50.0, 900.0)}, evaluations=10**9
    ),
    "simulate": lambda: tiltrim.simulate(
        tiltrim.Model("still", lambda x, u, p: (say(), -x)[1], states=["x"]), {"x": 1}, 1e9,
        max_steps=10**9, sample=1e3,
    ),
}  # fmt: skip

if __name__ == "__main__":
    begun = True
    try:
        print("ended by itself:", VERBS[sys.argv[1]]())
    except KeyboardInterrupt:
        print("KeyboardInterrupt")
