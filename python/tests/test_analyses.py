"""margins, envelope, all_equilibria, monte_carlo, report: against the program and closed forms."""

import math
import os
import subprocess

import numpy as np
import pytest
import tiltrim
from conftest import ROOT
from test_program import same


@pytest.fixture(scope="module")
def paper(studies):
    return studies / "paper.toml"


# ---- Margins ------------------------------------------------------------------------------------


def third_order(K=2.0, closed=True):
    """y = u/(s (s + 1)(s + 2)); closed by u = -K y + added, with the command -K y as an output."""
    back = K if closed else 0.0
    model = tiltrim.Model(
        "third order",
        lambda x, u, p: [x[1], x[2], u[0] - back * x[0] - 2 * x[1] - 3 * x[2]],
        states=["y", "rate", "bend"],
        inputs=["added"],
        outputs=["command"],
        h=lambda x, u, p: [-K * x[0]],
        derivatives=lambda x, u, p: [
            [0, 1, 0, 0], [0, 0, 1, 0], [-back, -2, -3, 1], [-K, 0, 0, 0]],
    )  # fmt: skip
    return tiltrim.linearize(model, {})


def test_margins_are_the_closed_form():
    K = 2.0
    held = tiltrim.margins(third_order(K), {"u": ("added", "command")})
    assert held and held.verdict == "stable" and held.status == "linear"
    loop = held["u"]
    assert loop.gain_up == pytest.approx(6 / K, rel=1e-10)  # Routh: K < 6
    assert loop.gain_up_at == pytest.approx(math.sqrt(2), rel=1e-10)
    assert loop.gain_down == 0
    ((crossover, lag),) = [c for c in loop.gain_crossovers if c[0] > 0]
    s = 1j * crossover
    assert abs(K / (s * (s + 1) * (s + 2))) == pytest.approx(1, rel=1e-9)
    phase = math.pi - math.pi / 2 - math.atan(crossover) - math.atan(crossover / 2)
    assert loop.phase == pytest.approx(phase, rel=1e-9) == pytest.approx(abs(lag))
    assert loop.delay == pytest.approx(phase / crossover, rel=1e-9)
    s = 1j * loop.frequency
    np.testing.assert_allclose(loop.magnitude, abs(K / (s * (s + 1) * (s + 2))), rtol=1e-9)
    opened = tiltrim.margins(
        third_order(K, closed=False), {"u": ("added", "y")}, closed=False, frequency=(0.1, 10)
    )["u"]
    assert opened.gain_up == pytest.approx(6.0, rel=1e-10)  # L = 1/(s (s + 1)(s + 2))
    assert opened.frequency[[0, -1]] == pytest.approx([0.1, 10]) and len(opened.frequency) == 200
    lost = tiltrim.margins(third_order(7.0), {"u": ("added", "command")})
    assert not lost and lost.verdict == "unstable" and not lost["u"]


def test_margins_within_the_errors_of_the_linear_model():
    wrong = tiltrim.Model(
        "wrong",
        lambda x, u, p: [x[1], -2 * x[0] - x[1] + u[0]],
        states=["x", "v"],
        inputs=["u"],
        derivatives=lambda x, u, p: [[0, 1, 0], [-2, -3, 1]],
    )
    linear = tiltrim.linearize(wrong, {"x": 0, "v": 0, "u": 0})
    assert linear.A_error[1, 1] >= 2 and tiltrim.modes(linear).verdict == "undecided"
    for closed in (True, False):
        found = tiltrim.margins(linear, {"u": ("u", "x")}, closed=closed)
        assert not found and not found.answered
        assert found.verdict == found["u"].verdict == "undecided"


def test_margins_of_a_study_are_the_programs(program, paper, studies):
    for file in (paper, studies / "levitation.toml"):
        own, printed = tiltrim.margins(file), program("margins", file)["conditions"]
        assert list(own) == [c["name"] for c in printed]
        compared = 0
        for c in printed:
            mine = own[c["name"]]
            assert mine.status == c["status"] and mine.verdict == c["verdict"]
            for theirs in c["loops"]:
                loop = mine[theirs["actuator"]]
                assert loop.in_use == theirs["in_use"]
                for name, value in (theirs["margins"] or {}).items():
                    if name in ("phase_crossings", "gain_crossovers"):
                        same(getattr(loop, name), [list(one.values()) for one in value])
                    else:
                        same(getattr(loop, name), [value])
                if theirs["bode"]:
                    same(loop.A, theirs["loop"]["A"])
                    same(loop.frequency, theirs["bode"]["frequency"])
                    same(loop.magnitude, theirs["bode"]["magnitude"])
                    same(loop.phase_of, theirs["bode"]["phase"])
                    compared += 1
        assert compared > 1
    one = tiltrim.margins(paper, ["delta_e"], condition="level", frequency=(0.5, 20), points=7)
    assert list(one.loops) == ["delta_e"] and len(one["delta_e"].frequency) == 7


def test_what_has_no_margins(paper):
    linear = third_order()
    with pytest.raises(TypeError, match=r"needs loops=\{name: \(input, output\)\}"):
        tiltrim.margins(linear)
    with pytest.raises(tiltrim.InvalidArgument, match="no input 'ad'; there are: added"):
        tiltrim.margins(linear, {"u": ("ad", "command")})
    with pytest.raises(tiltrim.InvalidArgument, match="no actuator 'elevator'; there are: theta0"):
        tiltrim.margins(paper, ["elevator"])
    slow = tiltrim.margins(tiltrim.tiltrotor(V=3.0))
    assert not slow and not slow.answered and slow.loops == {} and slow.message


# ---- Envelopes ----------------------------------------------------------------------------------


def bowl():
    """The trim is x = p² + q², at most 1: a disk."""
    model = tiltrim.Model(
        "bowl", lambda x, u, p: [p[0] ** 2 + p[1] ** 2 - x[0]], states=["x"], parameters=["p", "q"]
    )
    return tiltrim.Problem(model, {"p": 0.1, "q": 0.0}, free=["x"], steady=["x"], bounds={"x": (-1, 1)})


def test_an_envelope_is_the_disk():
    found = tiltrim.envelope(
        bowl(), along=("p", -2, 2), over=("q", -2, 2), count=21, rows=[0.0, 0.6, 1.5]
    )
    assert found and found.status == "complete"
    for at, intervals in found.rows:
        if at > 1:
            assert intervals == []
            continue
        ((low, low_by, high, high_by),) = intervals
        assert (low_by, high_by) == ("x upper", "x upper")
        assert (low, high) == pytest.approx((-math.sqrt(1 - at**2), math.sqrt(1 - at**2)))
    (piece,) = found.pieces
    assert (piece.name, piece.ends) == ("x upper", "loop") and piece.outer.all()
    np.testing.assert_allclose(np.hypot(piece.along, piece.over), 1, rtol=1e-9)
    np.testing.assert_allclose(piece["x"], 1, rtol=1e-9)
    np.testing.assert_array_equal(piece["p"], piece.along)
    (part,) = found.parts
    p, q = np.meshgrid(np.linspace(-2, 2, 21), np.linspace(-2, 2, 21), indexing="ij")
    inside = p**2 + q**2 < 1 - 1e-9
    assert (part.count[inside] == 1).all() and (part.count[p**2 + q**2 > 1 + 1e-9] == 0).all()
    pytest.importorskip("pandas")
    assert len(found.to_dataframe()) == len(piece)


def test_envelopes_of_a_study_are_the_programs(program, paper, studies):
    level = program("envelope", paper, "--count", 9, "--only", "level")["envelopes"][0]
    angles = program("envelope", paper, "--over", "gamma_deg", "--count", 9, "--only", "level")
    ball = program("envelope", studies / "levitation.toml")["envelopes"][0]
    for own, theirs in (
        (tiltrim.envelope(paper, count=9, condition="level"), level),
        (
            tiltrim.envelope(paper, over="gamma_deg", count=9, condition="level"),
            angles["envelopes"][0],
        ),
        (next(iter(tiltrim.envelope(studies / "levitation.toml").values())), ball),
    ):
        along, over = own.along.name, own.over.name
        assert over == theirs["over"] and own.model.name == theirs["model"]
        assert len(own.parts) == len(theirs["parts"])
        for part, printed in zip(own.parts, theirs["parts"]):
            assert part.status == printed["status"]
            same(part.along, printed[along])
            same(part.over, printed[over])
            same(part.count, printed["count"])
            for (at, intervals), row in zip(part.rows, printed["rows"]):
                same(at, [row[over]])
                assert intervals == [
                    (i["from"][along], i["from"]["which"], i["to"][along], i["to"]["which"])
                    for i in row["intervals"]
                ]
            assert [p.name for p in part.pieces] == [p["which"] for p in printed["pieces"]]
            for piece, points in zip(part.pieces, printed["pieces"]):
                same(piece.along, [p[along] for p in points["points"]])
                same(piece.over, [p[over] for p in points["points"]])
                for name in points["points"][0]["state"]:
                    same(piece[name], [p["state"][name] for p in points["points"]])


def test_what_has_no_envelope(studies):
    with pytest.raises(TypeError, match=r"needs along= and over=, each \(signal, lower, upper\)"):
        tiltrim.envelope(bowl(), along=("p", 0, 1))
    with pytest.raises(TypeError, match="its study has the ranges"):
        tiltrim.envelope(tiltrim.tiltrotor(), over=("eta", 0, 1))
    with pytest.raises(tiltrim.InvalidArgument, match="no envelope over 'eta'; there are: eta_deg"):
        tiltrim.envelope(tiltrim.tiltrotor(), over="eta")
    with pytest.raises(tiltrim.InvalidArgument, match="applies to the built-in tiltrotor"):
        tiltrim.envelope(studies / "levitation.toml", over="eta_deg")


# ---- All equilibria -----------------------------------------------------------------------------


def test_all_equilibria_of_a_cubic():
    model = tiltrim.Model(
        "cubic", lambda x, u, p: [x[0] ** 3 - x[0] + p[0]], states=["x"], parameters=["p"]
    )
    found = tiltrim.all_equilibria(
        model, {"p": 0.0}, free=["x"], steady=["x"], bounds={"x": (-3, 3)}, parameters=["p"], starts=5
    )
    assert found and len(found) == 3
    roots = sorted((e["x"], e.modes.verdict) for e in found)
    assert [x for x, _ in roots] == pytest.approx([-1, 0, 1], abs=1e-9)
    assert [verdict for _, verdict in roots] == ["unstable", "stable", "unstable"]
    assert repr(found).count("unstable") == 2
    none = tiltrim.all_equilibria(
        model, {"p": 99.0}, free=["x"], steady=["x"], bounds={"x": (-3, 3)}, starts=3
    )
    assert not none and none.none.status in ("infeasible", "not_found") and "0 equilibria" in repr(none)


def test_all_equilibria_of_a_study_are_the_programs(program, studies):
    file = studies / "stall.toml"
    printed = program("trim", file, "--all", "--only", "level")["conditions"][0]["equilibria"]
    own = tiltrim.all_equilibria(file, condition="level")
    assert (own.starts, own.branches) == (printed["starts"], printed["branches"])
    assert len(own) == len(printed["found"]) > 0
    for mine, theirs in zip(own, printed["found"]):
        assert (mine.found, mine.trim.status) == (theirs["found"], theirs["status"])
        same([mine[name] for name in theirs["state"]], list(theirs["state"].values()))
        same(mine.modes.spectral_abscissa, [theirs["spectral_abscissa"]])


# ---- Flights with scatter, and tuning twice -----------------------------------------------------


def scattered_study(studies, tmp_path):
    text = (studies / "transition.toml").read_text()
    file = tmp_path / "scatter.toml"
    assert "\nflights = 10000" in text
    file.write_text(text.replace("\nflights = 10000", "\nflights = 12"))
    return file


def test_monte_carlo_is_the_programs(program, studies, tmp_path):
    file = scattered_study(studies, tmp_path)
    own, printed = tiltrim.monte_carlo(file), program("simulate", file, "--monte-carlo")
    assert own and (own.asked, own.flown, own.good) == (12, 12, printed["good"])
    assert own.ends == printed["ends"]
    same([own.share, own.lower, own.upper], [printed[n] for n in ("share", "lower", "upper")])
    for mine, theirs in zip(own.worst, printed["worst"]):
        assert (mine.number, mine.status) == (theirs["number"], theirs["status"])
        assert mine.scattered == theirs["scattered"]
        same([mine.miss, mine.V_off], [theirs["miss"], theirs["V_off"]])
    again = tiltrim.fly(file, number=own.worst[0].number)
    assert again.status == own.worst[0].status
    with pytest.raises(tiltrim.InvalidArgument, match="99"):
        tiltrim.fly(file, number=99)


def test_a_study_is_tuned_by_its_second_algorithm_too(program, paper, tmp_path):
    file = tmp_path / "tune.toml"
    file.write_text(
        paper.read_text() + '\n[tune]\nsecond = "esch"\nevaluations = 1000\n[tune.goal]\n'
        'measure = "decay"\n[[tune.gain]]\nkey = "gains.K_Lp"\nfrom = 0.1\nto = 5.0\n'
    )
    own, printed = tiltrim.tune(file), program("tune", file)
    same(own.goal, [printed["goal"]["value"]])
    same(own.numbers, list(printed["gains"].values()))
    assert {own.algorithm, own.second_algorithm} == {"multistart", "esch"}
    assert own.second.goal == pytest.approx(own.goal, rel=1e-5) and own.second.second is None


def test_starts_are_keywords_too(paper):
    def study(keys):
        gains = "".join(
            f'[[tune.gain]]\nkey = "gains.{name}"\nfrom = 0.1\nto = 5.0\n'
            for name in ("K_Lp", "K_Li", "k_V")
        )
        few = f'\n[tune]\nsecond = "none"\nevaluations = 60\n{keys}'
        return tiltrim.parse_study(paper.read_text() + few + gains, "starts.toml")

    keyed = tiltrim.tune(study("regulator_starts = [0.1]\nplaced_starts = [0.5]\n"))
    own = tiltrim.tune(study(""), regulator_starts=[0.1], placed_starts=[0.5])
    assert own.numbers.tobytes() == keyed.numbers.tobytes()
    bounds = {name: (0.1, 5.0) for name in own.names}
    conditions = list(tiltrim.read_study(paper).conditions.values())
    best = tiltrim.tune(conditions, gains=bounds, evaluations=2, starts=[own.numbers])
    assert best.goal >= own.goal * (1 - 1e-12)
    assert tiltrim.tune(conditions, gains=bounds, evaluations=9, regulator_starts=[1.0])
    for wrong in ({"regulator_starts": [-1]}, {"placed_starts": [0]}, {"starts": [[1, 2]]}):
        with pytest.raises(ValueError):
            tiltrim.tune(conditions, gains=bounds, **wrong)


# ---- Report -------------------------------------------------------------------------------------


def test_the_report_is_the_programs_page(studies, tmp_path):
    pytest.importorskip("xarray")
    file = tmp_path / "own.toml"
    file.write_text((studies / "levitation.toml").read_text())
    os.symlink(file, tmp_path / "same.toml")
    done = tiltrim.report(file, tmp_path / "page.html", tables=tmp_path / "tables")
    page = (tmp_path / "page.html").read_bytes()
    program = os.environ.get("TILTRIM_PROGRAM", str(ROOT / "build/bin/tiltrim"))
    told = subprocess.run(
        [program, "report", file, "-o", tmp_path / "page.html"], capture_output=True, text=True
    )
    assert (tmp_path / "page.html").read_bytes() == page
    assert bool(done) == (told.returncode == 0)
    assert " ".join(told.stdout.split()).startswith(" ".join(done.summary.split()))
    assert str(tmp_path / "page.html") == done.file and done.summary.count("stable") > 1
    assert (tmp_path / "tables").is_dir() and done.summary.splitlines()[0].strip() in repr(done)
    map_of = tiltrim.sweep(file)
    tiltrim.save(map_of, tmp_path / "map.nc")
    tiltrim.report(file, tmp_path / "given.html", maps=[tmp_path / "map.nc"], only=["held"])
    assert b"map.nc" in (tmp_path / "given.html").read_bytes()
    with pytest.raises(tiltrim.InvalidArgument, match="name the same file; expected two"):
        tiltrim.report(file, file)
    with pytest.raises(tiltrim.InvalidArgument, match="no condition 'hold'"):
        tiltrim.report(file, tmp_path / "page.html", only=["hold"])
