"""prove: against the program, and what a study, a condition and a callable of progress do."""

import pickle
from pathlib import Path

import pytest
import tiltrim

CORRIDOR = Path(__file__).resolve().parents[2] / "studies/prove_corridor.toml"
LEVITATION = CORRIDOR.with_name("prove_levitation.toml")


@pytest.fixture
def short(tmp_path):
    text = CORRIDOR.read_text().replace("from = 0\n", "from = 60\n").replace("to = 120\n", "to = 66\n")
    path = tmp_path / "short.toml"
    path.write_text(text)
    return path


def test_the_same_as_the_program(short, program):
    theirs = program("prove", short)["theorems"][0]
    theorem = tiltrim.prove(short, condition="corridor")
    assert theorem and theorem.status == theirs["status"] == "proved"
    assert theorem.boxes == theirs["boxes"]
    assert theorem.stable == theirs["proved_stable"] == 1
    assert theorem.parameters == {"h": (60, 66)}
    assert [r.verdict for r in theorem.regions] == ["proved_stable"]
    assert theorem.regions[0].lower == {"h": 60} and theorem.regions[0].upper == {"h": 66}
    assert "proved: corridor, h 60 to 66" in repr(theorem)


def test_a_study_a_condition_and_a_pickle_say_the_same(short):
    study = tiltrim.read_study(short)
    whole = tiltrim.prove(study)
    assert list(whole) == ["corridor"]
    one = tiltrim.prove(study["corridor"], threads=1)
    assert one == whole["corridor"] == pickle.loads(pickle.dumps(one))


def test_the_certificate_is_that_of_the_program(short, tmp_path, program):
    tiltrim.prove(short, condition="corridor").save(tmp_path / "python.proof")
    program("prove", short, "--certificate", tmp_path / "program.proof")
    assert (tmp_path / "python.proof").read_bytes() == (tmp_path / "program.proof").read_bytes()


def test_a_model_given_as_formulas(tmp_path, program):
    study = tmp_path / "held.toml"
    study.write_text(LEVITATION.read_text().replace("percent = 20", "percent = 2"))
    theirs = program("prove", study)["theorems"][0]
    held = tiltrim.prove(study, condition="held")
    assert held.stable > 0.5 and held.unstable > 0.1
    assert (held.boxes, held.stable, held.unstable, held.undecided) == (
        theirs["boxes"], theirs["proved_stable"], theirs["proved_unstable"], theirs["undecided"]
    )  # fmt: skip
    # In closed form: stable where k_p exceeds the current over the gap.
    for r in held.regions:
        lower, upper = ((end["mass"] * 9.81 / 9.81e-5) ** 0.5 for end in (r.lower, r.upper))
        if r.verdict == "proved_stable":
            assert r.lower["k_p"] >= upper
        if r.verdict == "proved_unstable":
            assert r.upper["k_p"] <= lower
    with pytest.raises(ValueError, match="certificate"):
        held.save("levitation.proof")


def test_margin_boxes_and_progress(short):
    refused = tiltrim.prove(short, condition="corridor", margin=50.0, boxes=3)
    assert not refused and refused.margin == 50 and refused.boxes <= 3
    stopped = tiltrim.prove(CORRIDOR, condition="corridor", progress=lambda *news: False)
    assert stopped.interrupted and stopped.status == "partly"


def test_mistakes(short):
    with pytest.raises(ValueError, match="no condition 'coridor'"):
        tiltrim.prove(short, condition="coridor")
    with pytest.raises(ValueError, match="margin"):
        tiltrim.prove(short, margin=-1.0)
    with pytest.raises(tiltrim.InvalidArgument, match=r"damping: 1.0; expected 0 to 0.99"):
        tiltrim.prove(short, damping=1.0)
    with pytest.raises(tiltrim.StudyError, match="prove"):
        tiltrim.prove(CORRIDOR.with_name("paper.toml"))
