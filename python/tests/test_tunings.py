"""tune() of a study: everything that `tiltrim tune --format json` prints, bit for bit."""

import pytest
import tiltrim
from test_program import same

CONDITIONS = (
    '[[condition]]\nname = "transition"\nV = 6.0\ngamma_deg = 45.0\neta_deg = 45.0\n'
    '[[condition]]\nname = "level"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n'
)
GAINS = (
    '[[tune.gain]]\nkey = "gains.K_Lp"\nfrom = 0.1\nto = 5.0\n'
    '[[tune.gain]]\nkey = "gains.k_de"\nfrom = 0.5\nto = 10.0\n'
    '[[tune.limit]]\nmeasure = "damping"\nat_least = 0.3\n'
    '[[tune.limit]]\nmeasure = "frequency"\nat_most = 25.0\n'
)
# A ball held by a magnet of current i: unstable without the gains.
BALL = (
    '[model]\nname = "ball"\n'
    '[[model.state]]\nname = "gap"\nunit = "m"\nnominal = 0.01\nrate = "speed"\n'
    '[[model.state]]\nname = "speed"\nunit = "m/s"\nnominal = 0.1\nrate = "g - k/m*(i/gap)^2"\n'
    '[[model.let]]\nname = "i"\nvalue = "i0 + k_p*(gap - 0.01) + k_d*speed"\n'
    '[[model.parameter]]\nname = "g"\nvalue = 9.81\n[[model.parameter]]\nname = "m"\nvalue = 0.05\n'
    '[[model.parameter]]\nname = "k"\nvalue = 1e-4\n[[model.parameter]]\nname = "i0"\nvalue = 0.7\n'
    '[[model.parameter]]\nname = "k_p"\nvalue = 200.0\n'
    '[[model.parameter]]\nname = "k_d"\nvalue = 5.0\n'
    '[[condition]]\nname = "hanging"\ngap = [0.005, 0.02]\n[tune]\nevaluations = 150\nrobustness = 20\n'
    '[[tune.gain]]\nkey = "k_p"\nfrom = 75.0\nto = 500.0\n'
    '[[tune.gain]]\nkey = "k_d"\nfrom = 0.5\nto = 50.0\n'
    '[[tune.uncertain]]\nkey = "m"\npercent = 10\n'
    '[[tune.limit]]\nmeasure = "frequency"\nat_most = 300.0\n'
)
MASS = (
    "[model]\nstate = [{name = 'z', rate = 'v'},"
    " {name = 'v', rate = '-kp*(z - r) - kd*v + wind + push'}]\n"
    "output = [{name = 'command', value = '-kp*(z - r) - kd*v'}]\n"
    "input = [{name = 'wind'}, {name = 'r'}, {name = 'push'}]\n"
    "parameter = [{name = 'kp', value = 4}, {name = 'kd', value = 1}]\n"
    "loop = [{name = 'a', input = 'push', output = 'command'}]\n"
    "[[condition]]\nname = 'rest'\nwind = 0\nr = 0\n"
    "[tune]\nsecond = 'none'\nevaluations = 800\nregulator_starts = [1]\n"
    "gain = [{key = 'kp', from = 0.01, to = 100}, {key = 'kd', from = 0.01, to = 100}]\n"
    "goal = [{measure = 'peak_gain', input = 'wind', output = 'z', at_most = 0.2},"
    " {measure = 'settling_time', input = 'r', output = 'z', at_most = 3}]\n"
    "limit = [{measure = 'peak_sensitivity', of = 'a', at_most = 1.4},"
    " {measure = 'pole_region', frequency = 20, at_least = 1}]\n"
)
STUDIES = {
    "front and second search": CONDITIONS + '[tune]\nsecond = "esch"\nevaluations = 120\n'
    '[tune.front]\nmeasure = "frequency"\nfrom = 4.0\nto = 20.0\ncount = 3\n' + GAINS,
    "schedule": CONDITIONS + '[tune]\nsecond = "none"\nevaluations = 120\n'
    "schedule_eta_deg = [0, 90]\n" + GAINS,
    "scatter": CONDITIONS + '[tune]\nsecond = "mlsl"\nevaluations = 120\nrobustness = 30\nsamples = 2\n'
    '[[tune.uncertain]]\nkey = "aircraft.mass"\npercent = 10\n' + GAINS,
    "no candidate": CONDITIONS + '[tune]\nsecond = "none"\nevaluations = 0\n' + GAINS,
    "model": BALL,
    "goals over responses": MASS,
}  # fmt: skip


def same_search(own, printed):
    """What every search has: first, second, front."""
    for name in ("status", "message", "end", "interrupted", "out_of_time", "out_of_evaluations"):
        assert getattr(own, name) == printed[name], name
    same([own.starts, own.agreeing, own.evaluations], [printed[n] for n in
         ("starts", "agreeing", "evaluations")])  # fmt: skip
    same(own.stationarity, [printed["stationarity"]])
    gains = dict(printed["gains"] or {})
    if own.schedule and gains:
        same(own.schedule, gains.pop("eta"))
    assert list(own.gains) == list(gains)
    for name, values in gains.items():
        same(own[name], values if own.schedule else [values])


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_is_tuned_as_by_the_program(program, tmp_path, name):
    file = tmp_path / "tune.toml"
    file.write_text(STUDIES[name])
    own, printed = tiltrim.tune(file), program("tune", file)
    same_search(own, printed)
    same(own.goal, [printed.get("reserve", printed["goal"]["value"])])
    assert own.algorithm == printed["global"] and own.toml == printed["toml"]
    assert own.coalescing == printed["coalescing"]
    assert len(own.achieved) == len(printed["achieved"])
    for mine, theirs in zip(own.achieved, printed["achieved"]):
        for key in ("point", "scatter", "measure", "of", "unit", "active"):
            assert getattr(mine, key) == theirs[key]
        for key in ("limit", "value", "reserve"):
            same(getattr(mine, key), [theirs[key]])
        if theirs["eigenvalue"]:
            same([mine.eigenvalue.real, mine.eigenvalue.imag], list(theirs["eigenvalue"].values()))
    assert [e.name for e in own.effects] == [e["name"] for e in printed["effects"]]
    for mine, theirs in zip(own.effects, printed["effects"]):
        same([mine.value, mine.goal_less, mine.goal_more],
             [theirs[key] for key in ("value", "goal_less", "goal_more")])  # fmt: skip
        same(mine.slopes, theirs["slopes"])
        assert (mine.limits_less, mine.limits_more) == (theirs["limits_less"], theirs["limits_more"])
    assert (own.second is None) == (printed["second"] is None)
    if own.second:
        assert own.second_algorithm == printed["second"]["global"]
        same_search(own.second, printed["second"])
        same(own.second.goal, [printed["second"]["goal"]])
    assert (vars(own.robustness) if own.robustness else None) == printed["robustness"]
    assert own.front_limit == ((printed["front_limit"]["measure"], "") if own.front else ())
    assert len(own.front) == len(printed["front"])
    for mine, theirs in zip(own.front, printed["front"]):
        same([mine.limit, mine.result.goal], [theirs["limit"], theirs["goal"]])
        same_search(mine.result, theirs)


def test_what_these_studies_ask_for_is_answered(tmp_path):
    found = {name: tiltrim.parse_study(text, "tune.toml") for name, text in STUDIES.items()}
    front = tiltrim.tune(found["front and second search"])
    assert front.second and [p.limit for p in front.front] == [4.0, 12.0, 20.0]
    assert [p.result.status for p in front.front] == ["limits_unmet", "tuned", "tuned"]
    assert "frequency" in repr(front) and repr(front.front[1]) == "limit 12: tuned"
    assert tiltrim.tune(found["scatter"]).robustness.samples == 30
    assert "of 20 random samples" in repr(tiltrim.tune(found["model"]))
    assert tiltrim.tune(found["schedule"])["gains.K_Lp"].shape == (2,)
    assert tiltrim.tune(found["no candidate"]).status == "no_trim"


def test_goals_over_responses_are_asked_for_by_dictionaries():
    def f(x, u, p):
        return [x[1], -p[0] * (x[0] - u[1]) - p[1] * x[1] + u[0]]

    mass = tiltrim.Model(
        "mass", f, states=["z", "v"], inputs=["wind", "r"], parameters=["kp", "kd"],
    )  # fmt: skip
    own = tiltrim.tune(
        mass,
        {"z": 0, "v": 0, "wind": 0, "r": 0, "kp": 1, "kd": 1},
        gains={"kp": (0.01, 100), "kd": (0.01, 100)},
        goal={"measure": "h2_norm", "input": "wind", "output": ["z", "v"]},
        limits=[
            {"measure": "peak_gain", "input": ["wind"], "output": "z", "at_most": 0.5,
             "weight": {"numerator": [2], "denominator": [1]}},
            {"measure": "quadratic_cost", "weights": {"z": 1.0}, "at_most": 3},
            ("frequency", 10),
        ],
        disturbance={"z": 1},
        free=["z", "v"],
        steady=["z", "v"],
        evaluations=2000,
    )  # fmt: skip
    assert own.status == "tuned" and own.goal_measure == "h2_norm"
    # of z and v for white noise: (1/kp + 1)/(2 kd)
    assert own.goal**2 == pytest.approx((1 / own["kp"] + 1) / (2 * own["kd"]), rel=1e-6)
    targets = tiltrim.tune(
        mass,
        {"z": 0, "v": 0, "wind": 0, "r": 0, "kp": 1, "kd": 1},
        gains={"kp": (0.01, 100), "kd": (0.01, 100)},
        goal=[
            {"measure": "peak_gain", "input": "wind", "output": "z", "at_most": 0.1},
            {"measure": "frequency", "at_most": 5},
        ],
        free=["z", "v"],
        steady=["z", "v"],
        evaluations=2000,
    )  # fmt: skip
    assert targets.goal_measure == "reserve of 2 goals"
    goals = [a for a in targets.achieved if a.goal]
    assert len(goals) == 2 and min(a.reserve for a in goals) == pytest.approx(targets.goal)
    with pytest.raises(ValueError, match="no signal 'gust'"):
        tiltrim.tune(
            mass, {"z": 0, "v": 0, "wind": 0, "r": 0, "kp": 1, "kd": 1}, gains={"kp": (1, 2)},
            goal={"measure": "peak_gain", "input": "gust", "output": "z"}, free=["z", "v"],
            steady=["z", "v"],
        )  # fmt: skip
    for wrong, words in (
        ({"limits": [{"measure": "frequency", "at_least": 3}]}, "for frequency, less is better; expected at_most"),
        ({"limits": [{"measure": "damping", "at_most": 0.3}]}, "for damping, more is better; expected at_least"),
        ({"limits": [{"measure": "damping", "at_least": 0.3, "limit": 1}]}, "damping has two limits"),
        ({"limits": ["frequency"]}, "limits: expected .measure, limit. or a dictionary, got 'frequency'"),
        ({"goal": None}, "goal: expected a measure, .measure, of. or a dictionary, got None"),
        ({"linear": "kp"}, "linear: expected a list of names"),
        ({"linear": ["Kp"]}, "linear: 'Kp' is no gain; there are: kp"),
        ({"disturbance": {"z": float("nan")}}, "disturbance: z: expected a finite number, got nan"),
        ({"time_limit": 0}, "a time limit of 0 s; expected more than 0 s"),
    ):
        with pytest.raises((ValueError, TypeError), match=words):
            tiltrim.tune(
                mass, {"z": 0, "v": 0, "wind": 0, "r": 0, "kp": 1, "kd": 1}, gains={"kp": (1, 2)},
                free=["z", "v"], steady=["z", "v"], **{"goal": "decay", **wrong},
            )  # fmt: skip
