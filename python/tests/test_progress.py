"""progress=: what it receives and where it runs, how it stops a verb, and what True shows."""

import importlib.machinery
import importlib.util
import sys
import threading
import types

import numpy as np
import pytest
import tiltrim
from test_analyses import bowl, scattered_study
from test_program import same
from written_models import held_ball


def level():
    return tiltrim.tiltrotor(V=15.0)


TUNED = {"gains": {"gains.K_Lp": (0.1, 5.0)}, "evaluations": 40}
VERBS = {
    "sweep": lambda tell: tiltrim.sweep(level(), axes={"gains.K_Lp": [0.5, 1.0]}, progress=tell),
    "sweep of callables": lambda tell: tiltrim.sweep(
        held_ball(), axes={"k_p": np.linspace(80, 200, 9)}, progress=tell
    ),
    "tune": lambda tell: tiltrim.tune(level(), progress=tell, **TUNED),
    "tune of callables": lambda tell: tiltrim.tune(
        held_ball(), gains={"k_d": (0.5, 20)}, evaluations=30, progress=tell
    ),
    "envelope": lambda tell: tiltrim.envelope(level(), count=5, progress=tell),
    "envelope of callables": lambda tell: tiltrim.envelope(
        bowl(), along=("p", -2, 2), over=("q", -2, 2), count=9, progress=tell
    ),
}


@pytest.fixture(autouse=True)
def needs_xarray():
    pytest.importorskip("xarray")


@pytest.mark.parametrize("verb", VERBS)
def test_it_receives_numbers_and_words_in_the_callers_thread(verb):
    received = []

    def tell(done, total, text):
        assert threading.current_thread() is threading.main_thread()
        received.append((done, total, text))

    answer, silent = VERBS[verb](tell), VERBS[verb](None)
    assert repr(answer) == repr(silent)  # the same result
    assert received
    for done, total, text in received:
        assert 0 <= done <= total and isinstance(text, str) and text
    if not verb.startswith("tune"):  # a tuning may end early
        assert received[-1][0] == received[-1][1]


@pytest.mark.parametrize("verb", VERBS)
def test_its_exception_ends_the_verb(verb):
    error = LookupError("enough")

    def tell(done, total, text):
        raise error

    with pytest.raises(LookupError) as caught:
        VERBS[verb](tell)
    assert caught.value is error


def endless_tuning(tell):
    gains = ("k_V", "K_Ep", "K_Ei", "K_Lp", "K_Li", "k_pa", "k_da", "k_pe", "k_de")
    bounds = {f"gains.{name}": (0.02, 10.0) for name in gains}
    return tiltrim.tune(level(), gains=bounds, evaluations=10**9, progress=tell)


def test_keyboard_interrupt_within_it_ends_built_in_work():
    def tell(done, total, text):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        endless_tuning(tell)


def test_false_stops_with_what_there_is(studies, tmp_path):
    best = endless_tuning(lambda done, total, text: False)
    assert best.interrupted and best.evaluations > 0 and best.status == "tuned"
    assert 0.02 <= best["gains.K_Lp"] <= 10.0 and np.isfinite(best.goal)
    file = tmp_path / "many.toml"
    text = (studies / "transition.toml").read_text()
    file.write_text(text.replace("\nflights = 10000", "\nflights = 1000000"))
    run = tiltrim.monte_carlo(file, progress=lambda done, total, text: False)
    assert run.interrupted and not run and 0 < run.flown < run.asked == 1_000_000
    part = tiltrim.envelope(level(), count=400, progress=lambda done, total, text: False)
    assert part.status == "interrupted" and not part


@pytest.mark.parametrize(
    "problem, axes",
    [
        (level(), {"gains.K_Lp": np.linspace(0.5, 2, 400), "V": np.linspace(12, 18, 1000)}),
        (held_ball(), {"k_d": np.linspace(1, 20, 300), "k_p": np.linspace(80, 200, 300)}),
    ],
    ids=["built in", "of callables"],
)
def test_false_stops_a_sweep_with_its_finished_lines(problem, axes, tmp_path):
    first, second = axes
    told = []
    part = tiltrim.sweep(
        problem, axes=axes, progress=lambda *news: bool(told.append(news)), crossings=False, threads=1
    )  # one thread: it takes longer than until the first news
    missing = part.status.values == "not_reached"
    lines = np.flatnonzero(~missing.any(axis=1))
    assert missing.all(axis=1).sum() + len(lines) == len(axes[first])  # whole lines, from the first
    assert lines.tolist() == list(range(len(lines))) and 0 < len(lines) < len(axes[first])
    assert len(lines) * len(axes[second]) >= told[-1][0] > 0
    of = f"stopped with {missing.sum()} of {missing.size} points missing"
    assert part.attrs["interrupted"] == of
    for name in ("eigenvalue", "state_value", "input_value", "spectral_abscissa", "residual"):
        assert np.isnan(part[name].values[missing]).all()
    assert (part.verdict.values[missing] == "").all()
    # The finished lines are those of a whole map.
    few = {first: axes[first][:2], second: axes[second]}
    whole = tiltrim.sweep(problem, axes=few, crossings=False)
    same(part.spectral_abscissa.values[:1].ravel(), whole.spectral_abscissa.values[:1].ravel())
    assert "interrupted" not in whole.attrs
    tiltrim.save(part, tmp_path / "m.nc")
    assert (tiltrim.open_map(tmp_path / "m.nc").status.values[0] == part.status.values).all()


def test_a_keyboard_interrupt_ends_a_sweep_at_once():
    def tell(done, total, text):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        VERBS["sweep of callables"](tell)


def test_other_values_do_not_stop(studies, tmp_path):
    calls = []
    run = tiltrim.monte_carlo(
        scattered_study(studies, tmp_path), progress=lambda *news: calls.append(news) or 0
    )
    assert run and calls[-1][:2] == (12, 12) and "good" in calls[-1][2]


def fake_tqdm(monkeypatch):
    """A package tqdm that keeps its bars."""
    bars = []

    class Bar:
        def __init__(self, total, desc):
            self.total, self.desc, self.n, self.text, self.closed = total, desc, 0, "", False
            bars.append(self)

        def set_postfix_str(self, text):
            self.text = text

        def close(self):
            self.closed = True

    for name in ("tqdm", "tqdm.auto"):
        module = types.ModuleType(name)
        module.__spec__ = importlib.machinery.ModuleSpec(name, None)
        module.tqdm = Bar
        monkeypatch.setitem(sys.modules, name, module)
    return bars


def test_true_is_a_bar_of_tqdm(monkeypatch):
    bars = fake_tqdm(monkeypatch)
    VERBS["sweep of callables"](True)
    assert {bar.desc for bar in bars} <= {"points", "lines"} and all(bar.closed for bar in bars)
    assert bars[-1].n == bars[-1].total and "stable" in bars[-1].text


def test_true_without_tqdm_is_a_line(capsys, monkeypatch):
    there = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "tqdm" else there(name)
    )
    VERBS["sweep"](True)
    err = capsys.readouterr().err
    assert err.startswith("\r") and "stable" in err and err.endswith("\n")
    VERBS["sweep"](False)
    assert capsys.readouterr().err == ""
    with pytest.raises(TypeError, match=r"progress: expected True or progress\(done, total, text\)"):
        VERBS["sweep"]("yes")
