"""Every verb on a study or its path: the numbers of the program's command on it."""

import inspect

import numpy as np
import pytest
import tiltrim
from test_program import same


@pytest.fixture(scope="module")
def paper(studies):
    return studies / "paper.toml"


def test_trim_linearize_and_modes_of_a_study_are_the_programs(program, paper):
    printed = {c["name"]: c for c in program("linearize", paper)["conditions"]}
    trims, linears = tiltrim.trim(paper), tiltrim.linearize(str(paper))
    found = tiltrim.modes(tiltrim.read_study(paper))
    assert list(trims) == list(linears) == list(found) == list(printed)
    for name, c in printed.items():
        assert trims[name].status == c["status"]
        same([trims[name][s] for s in c["state"]], list(c["state"].values()))
        same(trims[name].residual, [c["residual"]])
        same(linears[name].A, c["linear"]["A"])
        same(linears[name].B, c["linear"]["B"])
        assert found[name].verdict == c["verdict"]
        same(found[name].eigenvalues.real, [m["re"] for m in c["modes"]])
        same(found[name].eigenvalues.imag, [m["im"] for m in c["modes"]])
    level = tiltrim.modes(paper, condition="level")
    assert level.eigenvalues.tolist() == found["level"].eigenvalues.tolist()
    assert tiltrim.trim(paper, condition="level", starts=0).starts == 1


def test_angles_in_the_other_unit_are_warned_of():
    text = '[[condition]]\nname = "a"\nV = 15\ngamma_deg = %s\neta_deg = 0\n'
    remark = "t.toml:4:13: gamma_deg = 1.5708 is 1.57 degrees; 1.5708 rad would be 90 degrees"
    with pytest.warns(UserWarning) as warned:
        study = tiltrim.parse_study(text % 1.5708, "t.toml")
    assert [str(w.message) for w in warned] == [remark] and warned[0].filename == __file__
    assert study["a"].guess  # valid, as given
    with pytest.warns(UserWarning, match="would be 90 degrees"):
        assert tiltrim.tiltrotor(gamma_deg=1.5708).name == "condition"


def test_follow_of_a_study_is_the_programs(program, paper):
    command = ("follow", paper, "--parameter", "gains.K_Lp", "--to", "1.0")
    printed = program(*command)["branches"]
    branches = tiltrim.follow(paper, parameter="gains.K_Lp", to=1.0)
    assert list(branches) == [b["condition"] for b in printed]
    for branch, theirs in zip(branches.values(), printed):
        points = [*theirs["points"], theirs["events"][-1]]
        same(branch.values, [p["gains.K_Lp"] for p in points])
        same(branch["theta"], [p["state"]["theta"] for p in points])


def test_follow_refuses_what_the_program_refuses(studies, paper):
    with pytest.raises(tiltrim.InvalidArgument, match="the gains move with the tilt"):
        tiltrim.follow(studies / "scheduled.toml", parameter="eta_deg", to=5.0)
    with pytest.raises(tiltrim.InvalidArgument, match="to: -3 is out of range; expected V from 0"):
        tiltrim.follow(paper, parameter="V", to=-3.0, condition="level")


def test_sensitivities_of_a_study_are_the_programs(program, paper):
    asked = ["V", "eta_deg", "aircraft.mass", "gains.K_Lp"]
    for own, printed in (
        (tiltrim.sensitivities(paper), program("sensitivities", paper)),
        (
            tiltrim.sensitivities(paper, asked),
            program("sensitivities", paper, "--parameters", ",".join(asked)),
        ),
    ):
        for mine, theirs in zip(own.values(), printed["conditions"]):
            assert [p.parameter.name for p in mine.parameters] == [
                p["parameter"] for p in theirs["parameters"]
            ]
            for a, b in zip(mine.parameters, theirs["parameters"]):
                same(a.x, list(b["state"].values()))
                same(a.eigenvalue.real, [m["re"] for m in b["modes"]])
                same(a.frequency, [m["frequency"] for m in b["modes"]])


def test_sweep_tune_and_simulate_take_a_path(program, studies, paper, tmp_path):
    pytest.importorskip("xarray")
    own = tmp_path / "tune.toml"
    own.write_text(
        paper.read_text() + '\n[tune]\nsecond = "none"\nevaluations = 60\n[tune.goal]\n'
        'measure = "decay"\n[[tune.gain]]\nkey = "gains.K_Lp"\nfrom = 0.1\nto = 5.0\n'
    )
    best, printed = tiltrim.tune(own), program("tune", own)
    assert best.status == printed["status"]
    same(best.goal, [printed["goal"]["value"]])
    same(best.numbers, list(printed["gains"].values()))
    ds = tiltrim.sweep(studies / "levitation.toml")
    same(ds.spectral_abscissa, [p["spectral_abscissa"] for p in
                                program("sweep", studies / "levitation.toml")["points"]])  # fmt: skip
    ds = tiltrim.sweep(paper, axes={"gains.K_Lp": [0.5, 1.0]}, only=["level", "climb"])
    alone = tiltrim.sweep(tiltrim.read_study(paper)["level"], axes={"gains.K_Lp": [0.5, 1.0]})
    assert ds.condition.values.tolist() == ["climb", "level"]
    same(ds.eigenvalue.sel(condition="level").values.real, alone.eigenvalue.values.real)
    flight = tiltrim.simulate(studies / "transition.toml")
    again = tiltrim.fly(studies / "transition.toml")
    assert flight.status == program("simulate", studies / "transition.toml")["status"]
    assert np.array_equal(flight["theta_deg"], again["theta_deg"])
    with pytest.raises(TypeError, match="its start and duration are its own"):
        tiltrim.simulate(studies / "transition.toml", {}, 1.0)


def test_conditions_without_an_answer(tmp_path):
    study = tiltrim.parse_study(
        '[[condition]]\nname = "level"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n'
        '[[condition]]\nname = "slow"\nV = 3.0\ngamma_deg = 0.0\neta_deg = 0.0\n',
        "two.toml",
    )
    assert [bool(t) for t in tiltrim.trim(study).values()] == [True, False]
    assert [bool(m) for m in tiltrim.linearize(study).values()] == [True, False]
    assert list(tiltrim.modes(study)) == ["level"]
    assert list(tiltrim.bode(study, "V", "theta")) == ["level"]
    with pytest.raises(tiltrim.InvalidArgument, match="no linear model"):
        tiltrim.modes(study, condition="slow")
    with pytest.raises(tiltrim.InvalidArgument, match=r"two.toml: no condition 'levle' \(nearest"):
        tiltrim.modes(study, condition="levle")
    with pytest.raises(tiltrim.InvalidArgument, match="two.toml:1:1: condition 'level': 'mas' is not a number"):
        tiltrim.sensitivities(study, ["mas"])
    with pytest.raises(TypeError, match="condition= names one of a study's conditions"):
        tiltrim.trim(study["level"], condition="level")
    with pytest.raises(tiltrim.StudyError, match="missing.toml"):
        tiltrim.trim(tmp_path / "missing.toml")


def test_a_table_has_no_linear_model(studies):
    found = tiltrim.modes(studies / "printed.toml")
    assert "Table 1, level" in found and "Table 3, climb" not in found


def test_the_signature_names_the_condition():
    for verb in (tiltrim.trim, tiltrim.linearize, tiltrim.modes, tiltrim.bode, tiltrim.follow,
                 tiltrim.sensitivities):  # fmt: skip
        shown = inspect.signature(verb).parameters
        assert shown["condition"].kind is inspect.Parameter.KEYWORD_ONLY
        assert "condition=" in verb.__doc__


def test_what_is_no_study_is_named():
    level = tiltrim.trim(tiltrim.tiltrotor(V=15.0))
    for verb, rest in (("report", ("x.html",)), ("monte_carlo", ()), ("fly", ()), ("prove", ())):
        words = rf"^{verb}\(\): expected a Study or its path, not {type(level).__name__}$"
        with pytest.raises(TypeError, match=words):
            getattr(tiltrim, verb)(level, *rest)
    with pytest.raises(TypeError, match=r"^tune\(\) of a model needs a guess"):
        tiltrim.tune(level.point.model, gains={"K_EP": (0.1, 1.0)})
