"""The built-in model: Python's results equal the program's, bit for bit.

The program's JSON has every digit that a double needs, so equal numbers are equal bits.
"""

import math

import numpy as np
import pytest

import tiltrim


def same(own, printed):
    """Equal bits; JSON has null for values that are not finite."""
    own = np.asarray(own, dtype=float).ravel().tolist()
    flat = np.asarray(printed, dtype=object).ravel().tolist()
    assert len(own) == len(flat)
    for mine, theirs in zip(own, flat):
        if theirs is None:
            assert not math.isfinite(mine)
        else:
            assert mine == theirs and math.copysign(1, mine) == math.copysign(1, theirs)


@pytest.mark.parametrize("name", ["paper", "airframe", "stall", "printed"])
def test_trims_and_linear_models(program, studies, name):
    file = studies / f"{name}.toml"
    conditions = tiltrim.read_study(file).conditions
    printed = program("linearize", file)["conditions"]
    assert [c["name"] for c in printed] == list(conditions)
    compared = 0
    for c in printed:
        held = tiltrim.trim(conditions[c["name"]])
        assert (held.status, held.message) == (c["status"], c["message"])
        assert held.limits_active == c["limits_active"]
        same([held.residual, held.step, held.rcond], [c["residual"], c["step"], c["rcond"]])
        same([held.effort, held.starts], [c["effort"], c["starts"]])
        same(held.rates, list(c["rates"].values()))
        at = c if c["state"] is not None else c["closest"]
        for values in (at["state"], at["input"], at["output"]):
            same([held[signal] for signal in values], list(values.values()))
        same([p.x for p in held.others], [list(x.values()) for x in c["others"]])
        if held.moment:
            same(held.moment, list(c["moment"].values()))
        if "modes" not in c:
            continue
        linear = tiltrim.linearize(held)
        for matrix in ("A", "B", "C", "D", "A_error", "B_error", "C_error", "D_error"):
            same(getattr(linear, matrix), c["linear"][matrix])
        same(linear.A_differences, c["linear"]["A_differences"])
        assert linear.remarks == c["linear"]["remarks"]
        found = tiltrim.modes(linear)
        assert found.verdict == c["verdict"]
        same(found.spectral_abscissa, [c["spectral_abscissa"]])
        assert found.names == [m["name"] for m in c["modes"]]
        same([m.eigenvalue.real for m in found.modes], [m["re"] for m in c["modes"]])
        same([m.eigenvalue.imag for m in found.modes], [m["im"] for m in c["modes"]])
        same(found.error, [m["error"] for m in c["modes"]])
        same(
            [m.participation for m in found.modes],
            [list(m["participation"].values()) for m in c["modes"]],
        )
        compared += 1
    assert compared > 0 or name == "printed"


def test_a_sweep(program, studies):
    pytest.importorskip("xarray")
    file = studies / "map_corridor.toml"
    ds = tiltrim.sweep(tiltrim.read_study(file))
    printed = program("sweep", file)
    points = printed["points"]
    assert ds.status.values.ravel().tolist() == [p["status"] for p in points]
    assert ds.verdict.values.ravel().tolist() == [p["verdict"] or "" for p in points]
    trimmed = ds.isel(condition=0).where(ds.verdict.isel(condition=0) != "", drop=True)
    points = [p for p in points if p["verdict"]]
    same(trimmed.residual, [p["residual"] for p in points])
    same(trimmed.state_value, [list(p["state"].values()) for p in points])
    same(trimmed.input_value, [list(p["input"].values()) for p in points])
    same(trimmed.eigenvalue.values.real, [[m["re"] for m in p["modes"]] for p in points])
    same(trimmed.eigenvalue.values.imag, [[m["im"] for m in p["modes"]] for p in points])
    same(trimmed.confidence, [[m["confidence"] for m in p["modes"]] for p in points])
    assert ds.sizes["crossing"] == len(printed["crossings"]) > 0
    same(ds.crossing_frequency, [c["frequency"] for c in printed["crossings"]])
    same(ds.crossing_at[:, 0], [c["at"]["h"] for c in printed["crossings"]])
    same(ds.interval_abscissa, [i["abscissa"] for i in printed["intervals"]])


def test_a_sweep_asked_for_in_python(program, studies, tmp_path):
    pytest.importorskip("xarray")
    condition = tiltrim.tiltrotor(V=15.0, name="level")
    values = [0.2, 0.5, 1.0, 2.5]
    ds = tiltrim.sweep(condition, axes={"gains.K_Lp": values})
    file = tmp_path / "same.toml"
    file.write_text(
        '[[condition]]\nname = "level"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n'
        f'[[sweep.axis]]\nkey = "gains.K_Lp"\nvalues = {values}\n'
    )
    points = program("sweep", file)["points"]
    assert ds.eigenvalue.dims == ("K_Lp", "mode")
    same(ds.eigenvalue.values.real, [[m["re"] for m in p["modes"]] for p in points])
    with pytest.raises(tiltrim.StudyError, match="K_Lpp"):
        tiltrim.sweep(condition, axes={"gains.K_Lpp": values})
    many = np.linspace(0.2, 0.3, 60_000)  # more text than a study's file may have
    assert tiltrim.sweep(condition, axes={"gains.K_Lp": many}, crossings=False).sizes["K_Lp"] == len(many)
    own = tiltrim.read_study(studies / "map_corridor.toml").conditions["corridor"]
    with pytest.raises(TypeError, match="axes of its own"):
        tiltrim.sweep(own, axes={"V": [5, 6]})


def test_a_branch(program, studies):
    file = studies / "stall.toml"
    branch = tiltrim.follow(tiltrim.read_study(file).conditions["level"])
    printed = program("follow", file, "--only", "level")["branches"][0]
    points = [*printed["points"], printed["events"][-1]]  # the end is a trim too
    same(branch.values, [p["V"] for p in points])
    same(branch["theta"], [p["state"]["theta"] for p in points])
    same(branch["delta_e"], [p["input"]["delta_e"] for p in points])
    assert [e.kind for e in branch.events] == [e["kind"] for e in printed["events"]]
    same([e.parameter for e in branch.events], [e["V"] for e in printed["events"]])
    assert branch.parameter.name == "V" and branch.parameter.unit == "m/s"


def test_sensitivities(program, studies):
    file = studies / "paper.toml"
    own = tiltrim.sensitivities(tiltrim.read_study(file).conditions["level"])
    printed = program("sensitivities", file, "--only", "level")["conditions"][0]
    assert own and own.status == printed["sensitivities"]
    compared = 0
    for theirs in printed["parameters"]:
        if theirs["unit"] == "degrees":  # SI and radians in Python
            continue
        mine = own[theirs["parameter"]]
        same(mine.value, [theirs["value"]])
        same(mine.x, list(theirs["state"].values()))
        same(mine.outputs, list(theirs["output"].values()))
        same(mine.eigenvalue.real, [m["re"] for m in theirs["modes"]])
        same(mine.damping, [m["damping"] for m in theirs["modes"]])
        compared += 1
    assert compared > 20 and len(own.parameters) == len(printed["parameters"])
    with pytest.raises(ValueError, match="no sensitivities to 'mass'; there are: V"):
        own["mass"]


def test_a_tuning(program, tmp_path):
    file = tmp_path / "tune.toml"
    file.write_text(
        '[[condition]]\nname = "level"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n'
        '[tune]\nsecond = "none"\nevaluations = 150\n[tune.goal]\nmeasure = "decay"\n'
        '[[tune.gain]]\nkey = "gains.K_Lp"\nfrom = 0.1\nto = 5.0\n'
        '[[tune.gain]]\nkey = "gains.K_Li"\nfrom = 0.01\nto = 1.0\n'
    )
    best = tiltrim.tune(tiltrim.read_study(file))
    printed = program("tune", file)
    assert best.status == printed["status"]
    same(best.goal, [printed["goal"]["value"]])
    same(best.numbers, list(printed["gains"].values()))
    own = tiltrim.tune(
        tiltrim.tiltrotor(V=15.0, name="level"),
        gains={"gains.K_Lp": (0.1, 5.0), "gains.K_Li": (0.01, 1.0)},
        evaluations=150,
        start=[0.75, 0.085],
    )
    assert own.gains == best.gains


def test_a_flight(program, studies):
    file = studies / "transition.toml"
    flight = tiltrim.fly(tiltrim.read_study(file))
    printed = program("simulate", file)
    assert flight and flight.status == printed["status"]
    assert [what for _, what, _ in flight.events] == [e["what"] for e in printed["events"]]
    same([t for _, _, t in flight.events], [e["t"] for e in printed["events"]])
    assert flight["theta_deg"].shape == flight["time"].shape
    pytest.importorskip("xarray")
    ds = flight.to_xarray()
    assert ds.V.attrs["units"] == "m/s" and ds.sizes["event"] == len(flight.events)
    with pytest.raises(ValueError, match="no column 'theta'; the flight has: time, V"):
        flight["theta"]


def test_a_study_with_a_model_of_formulas(program, studies):
    pytest.importorskip("xarray")
    file = studies / "levitation.toml"
    study = tiltrim.read_study(file)
    printed = program("linearize", file)["conditions"]
    for c in printed:
        condition = study.conditions[c["name"]]
        assert condition.formulation == "model"
        held = tiltrim.trim(condition)
        assert held.status == c["status"]
        same([held[name] for name in c["state"]], list(c["state"].values()))
        linear = tiltrim.linearize(held)
        same(linear.A, c["linear"]["A"])
        same(linear.B, c["linear"]["B"])
        assert tiltrim.modes(linear).verdict == c["verdict"]
    branch = tiltrim.follow(condition)
    printed = program("follow", file)["branches"][-1]
    assert [e.kind for e in branch.events] == [e["kind"] for e in printed["events"]]
    points = [*printed["points"], printed["events"][-1]]
    same(branch.values, [p[branch.parameter.name] for p in points])
    motion = tiltrim.fly(study)
    assert motion and motion.status == program("simulate", file)["status"]
    ds = tiltrim.sweep(study)
    printed = program("sweep", file)["points"]
    same(ds.spectral_abscissa, [p["spectral_abscissa"] for p in printed])


def test_units_of_the_keywords_are_those_of_a_study():
    condition = tiltrim.tiltrotor(V=6.0, gamma_deg=45.0, eta_deg=90.0, aircraft={"mass": 4.4})
    assert condition.guess["eta"] == math.pi / 2
    assert condition.guess["aircraft.mass"] == 4.4
    alone = tiltrim.tiltrotor(15.0, formulation="airframe", theta_deg=[-5, 5])
    assert alone.formulation == "airframe" and [s.name for s in alone.model.inputs] == [
        "theta0", "a1s", "delta_e", "eta"]  # fmt: skip
    assert tiltrim.trim(alone)
