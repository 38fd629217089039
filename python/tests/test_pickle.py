"""Every argument and result can be pickled and copied."""

import copy
import multiprocessing
import pickle
from pathlib import Path

import pytest
import tiltrim

STUDIES = Path(__file__).resolve().parents[2] / "studies"


def rates(x, u, p):
    return [x[1], u[0] - p[0] * x[0] ** 3]


def pendulum():
    return tiltrim.Model(
        "pendulum", rates, states=["angle", "rate"], inputs=["torque"], parameters=["k"]
    )


def held():
    return tiltrim.Problem(
        pendulum(), {"angle": 0.5, "k": 4.0}, free=["torque"], steady=["rate"], implied=["angle"]
    )


def loop():
    law = tiltrim.Model(
        "law", None, inputs=["angle"], outputs=["torque"], h=angle_to_torque, parameters=["gain"]
    )
    return tiltrim.feedback(pendulum(), law)


def angle_to_torque(x, u, p):
    return [-p[0] * u[0]]


def table():
    return next(
        c
        for file in sorted(STUDIES.glob("*.toml"))
        for c in tiltrim.read_study(file).conditions.values()
        if c.formulation == "table"
    )


EVERYTHING = {
    "Signal": lambda: pendulum().states[0],
    "Model": pendulum,
    "Point": lambda: pendulum().point(k=4.0),
    "TrimSpec": lambda: held().spec,
    "Problem": held,
    "feedback": loop,
    "Study": lambda: tiltrim.read_study(STUDIES / "paper.toml"),
    "Condition": lambda: tiltrim.tiltrotor(V=15.0),
    "user Condition": lambda: tiltrim.read_study(STUDIES / "levitation.toml").conditions["held"],
    "TrimResult": lambda: tiltrim.trim(held()),
    "TrimResult of a Condition": lambda: tiltrim.trim(tiltrim.tiltrotor(V=15.0)),
    "TrimResult of a table": lambda: tiltrim.trim(table()),
    "LinearModel": lambda: tiltrim.linearize(held()),
    "Modes": lambda: tiltrim.modes(held()),
    "Branch": lambda: tiltrim.follow(held(), parameter="angle", to=0.6),
    "Branch of a Condition": lambda: tiltrim.follow(tiltrim.tiltrotor(), parameter="V", to=14.0),
    "Sensitivities": lambda: tiltrim.sensitivities(held(), parameters=["k"]),
    "Margins": lambda: tiltrim.margins(tiltrim.tiltrotor()),
    "Qualities": lambda: tiltrim.qualities(tiltrim.tiltrotor(formulation="airframe")),
    "Theorem": lambda: tiltrim.prove(
        STUDIES / "prove_corridor.toml", condition="corridor", boxes=1
    ),
    "Envelope": lambda: tiltrim.envelope(
        held(), along=("k", 1, 2), over=("angle", 0.1, 0.5), count=5
    ),
    "Envelope of a Condition": lambda: tiltrim.envelope(tiltrim.tiltrotor(), count=5),
    "AllEquilibria": lambda: tiltrim.all_equilibria(held(), starts=3),
    "AllEquilibria of a Condition": lambda: tiltrim.all_equilibria(tiltrim.tiltrotor(), starts=9),
    "Trajectory": lambda: tiltrim.simulate(pendulum(), tiltrim.trim(held()), 1.0),
    "Flight": lambda: tiltrim.fly(tiltrim.read_study(STUDIES / "levitation.toml")),
}


@pytest.mark.parametrize("what", EVERYTHING)
def test_a_pickle_and_a_copy_say_the_same(what):
    first = EVERYTHING[what]()
    for other in (pickle.loads(pickle.dumps(first)), copy.copy(first), copy.deepcopy(first)):
        assert type(other) is type(first)
        assert repr(other) == repr(first)


def test_an_unpickled_problem_has_the_same_trim():
    problem = held()
    again = pickle.loads(pickle.dumps(problem))
    assert tiltrim.trim(again).point.as_dict() == tiltrim.trim(problem).point.as_dict()
    closed = pickle.loads(pickle.dumps(loop()))
    assert closed.evaluate(closed.point(angle=0.5, k=4.0, gain=2.0))[0].tolist() == [0.0, -1.5]


def trimmed(V):
    return tiltrim.trim(tiltrim.tiltrotor(V=V))


def test_a_pool_of_processes_gives_the_numbers_of_one():
    speeds = [13.0, 14.0, 15.0, 16.0]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        there = pool.map(trimmed, speeds)
    assert [t.point.as_dict() for t in there] == [trimmed(V).point.as_dict() for V in speeds]


def test_joblib():
    joblib = pytest.importorskip("joblib")
    there = joblib.Parallel(n_jobs=2)(joblib.delayed(trimmed)(V) for V in (14.0, 15.0))
    assert [t.point["theta"] for t in there] == [trimmed(V).point["theta"] for V in (14.0, 15.0)]
