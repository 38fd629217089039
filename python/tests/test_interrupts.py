"""Ctrl-C and threads: a verb stops and raises; who holds the GIL. No test is timed: a verb that
does not stop exceeds the test's time limit."""

import _thread
import functools
import os
import signal
import subprocess
import sys
import threading

import pytest
from written_models import held_ball

import tiltrim
from tiltrim import Model

HERE = os.path.dirname(__file__)
ENDLESS = 10**9
NINE_GAINS = {  # their starts do not agree for minutes
    f"gains.{name}": (0.02, 10.0)
    for name in ("k_V", "K_Ep", "K_Ei", "K_Lp", "K_Li", "k_pa", "k_da", "k_pe", "k_de")
}

BUILT_IN = {
    "tune": f"tiltrim.tune(c, gains={NINE_GAINS}, evaluations=10**9)",
    # At rest without lift: no trim, and no proof of it that would come before the search.
    "trim": "tiltrim.trim(tiltrim.tiltrotor(0.0, 0.0), starts=10**9)",
    "sweep": "tiltrim.sweep(tiltrim.tiltrotor(0.0, 0.0), starts=10**6,"
    " axes={'gains.K_Lp': np.linspace(0.1, 5, 5000)})",
}


def interrupted(*command):
    """Output of a program that is interrupted once it has printed "running"."""
    process = subprocess.Popen(
        [sys.executable, "-u", *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout.readline() == "running\n", process.stderr.read()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
    finally:
        process.kill()
    assert process.returncode == 0, err
    return out.strip()


@pytest.mark.parametrize("verb", BUILT_IN)
def test_ctrl_c_in_built_in_work(verb):
    if verb == "sweep":
        pytest.importorskip("xarray")
    # A thread reports that the verb has begun: the GIL is released. What sweep() imports is imported before:
    # of a signal within exec(), as dataclasses call it, Python dies although the exception is caught.
    script = f"""
import threading
import numpy as np
import tiltrim
{"import xarray" if verb == "sweep" else ""}
c = tiltrim.tiltrotor()
threading.Timer(0.5, lambda: print("running")).start()
try:
    print("ended by itself:", {BUILT_IN[verb]})
except KeyboardInterrupt:
    print("KeyboardInterrupt")
"""
    assert interrupted("-c", script) == "KeyboardInterrupt"


@pytest.mark.parametrize("verb", ["trim", "newton", "sweep", "tune", "simulate"])
def test_ctrl_c_in_callables(verb):
    if verb == "sweep":
        pytest.importorskip("xarray")
    assert interrupted(os.path.join(HERE, "endless.py"), verb) == "KeyboardInterrupt"


def test_another_thread_can_interrupt_built_in_work():
    timer = threading.Timer(0.2, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        tiltrim.tune(tiltrim.tiltrotor(), gains=NINE_GAINS, evaluations=ENDLESS)
    timer.join()


def test_a_handler_of_ones_own_raises_what_it_likes():
    class Alarm(Exception):
        pass

    def handler(number, frame):
        raise Alarm("time is up")

    before = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(Alarm, match="time is up"):
            tiltrim.tune(tiltrim.tiltrotor(), gains=NINE_GAINS, evaluations=ENDLESS)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


class Handler:
    """As an object; its method and a partial of it are handlers too."""

    def __call__(self, number, frame):
        raise TimeoutError("time is up")

    def method(self, number, frame):
        raise TimeoutError("time is up")


HANDLERS = {
    "function": lambda number, frame: (_ for _ in ()).throw(TimeoutError("time is up")),
    "object": Handler(),
    "method": Handler().method,
    "partial": functools.partial(Handler.method, None),
}


def verbs_of(m):
    """Each verb on x' = rates(x) of one state x and one parameter p."""
    asked = {"free": ["x"], "steady": ["x"], "bounds": {"x": (-9, 9)}}
    return {
        "trim": lambda: tiltrim.trim(m, {"p": 1}, **asked),
        "newton": lambda: tiltrim.trim(m, {"p": 1}, method="newton", **asked),
        "simulate": lambda: tiltrim.simulate(m, {"p": 1}, 1.0),
        "tune": lambda: tiltrim.tune(m, {"p": 1}, gains={"p": (1, 2)}, **asked),
        "follow": lambda: tiltrim.follow(
            tiltrim.Problem(m, {"p": 1}, **asked), parameter="p", to=2
        ),
        "linearize": lambda: tiltrim.linearize(m, {"x": 0, "p": 1}, moving=["x"]),
        "sweep": lambda: tiltrim.sweep(m, {"p": 1}, axes={"p": [1.0, 2.0]}, **asked),
    }


@pytest.mark.parametrize("kind", HANDLERS)
@pytest.mark.parametrize("verb", verbs_of(None))
def test_what_a_handler_raises_within_a_model_ends_the_verb(verb, kind):
    """An Exception too, which of the model itself would be its refusal at a point."""
    if verb == "sweep":
        pytest.importorskip("xarray")
    calls = []

    def rates(x, u, p):
        calls.append(1)
        if len(calls) == 4:
            signal.raise_signal(signal.SIGUSR1)
        return [1.0 + x[0] ** 2]

    before = signal.signal(signal.SIGUSR1, HANDLERS[kind])
    try:
        m = Model("m", rates, states=["x"], parameters=["p"])
        with pytest.raises(TimeoutError, match="time is up"):
            verbs_of(m)[verb]()
        assert len(calls) == 4  # none after it
    finally:
        signal.signal(signal.SIGUSR1, before)


def test_what_a_handler_raised_and_a_model_caught_is_the_models_affair():
    def rates(x, u, p):
        try:
            signal.raise_signal(signal.SIGUSR1)
        except TimeoutError as error:
            raise ValueError("no answer in time") from error
        return [x[0]]

    before = signal.signal(signal.SIGUSR1, HANDLERS["function"])
    try:
        m = Model("m", rates, states=["x"], parameters=["p"])
        result = verbs_of(m)["newton"]()
        assert result.status == "model_threw" and "no answer in time" in result.message
    finally:
        signal.signal(signal.SIGUSR1, before)


@pytest.mark.parametrize("error", [KeyboardInterrupt("mine"), SystemExit(3)])
def test_what_is_no_exception_of_a_model_ends_the_verb(error):
    calls = []

    def rates(x, u, p):
        calls.append(1)
        if len(calls) > 5:
            raise error
        return [1.0 + x[0] ** 2]

    m = Model("m", rates, states=["x"], parameters=["p"])
    asked = {"free": ["x"], "steady": ["x"], "bounds": {"x": (-9, 9)}}
    verbs = [
        lambda: tiltrim.trim(m, {"p": 1}, **asked),
        lambda: tiltrim.trim(m, {"p": 1}, method="newton", **asked),
        lambda: tiltrim.simulate(m, {"p": 1}, 1.0),
        lambda: tiltrim.tune(m, {"p": 1}, gains={"p": (1, 2)}, **asked),
        lambda: tiltrim.follow(tiltrim.Problem(m, {"p": 1}, **asked), parameter="p", to=2),
    ]
    for verb in verbs:
        calls.clear()
        with pytest.raises(type(error)) as caught:
            verb()
        assert caught.value is error
        assert len(calls) == 6  # none after it


def test_threads_with_callables_wait_for_each_other():
    answers = []

    def work():
        answers.append([tiltrim.trim(held_ball()).status for _ in range(5)])

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    built_in = [tiltrim.trim(tiltrim.tiltrotor()).status for _ in range(5)]
    for thread in threads:
        thread.join()
    assert answers == [["converged"] * 5] * 4 and built_in == ["converged"] * 5
