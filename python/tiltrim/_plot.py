"""plot: eigenvalues, branches, motions, Bode diagrams and maps with matplotlib."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _tiltrim
from ._envelope import Envelope
from ._equilibria import AllEquilibria
from ._follow import Branch
from ._linear import Bode, LinearModel, Modes
from ._margins import LoopMargins, Margins
from ._models import Array
from ._needs import need
from ._problems import Problem
from ._simulate import Flight, Trajectory
from ._studies import Condition
from ._trim import TrimResult

BLUE, RED, GREY = "#0072b2", "#d55e00", "#777777"


def plot(what: Any, *names: str, axes: Any = None) -> Any:
    """Draws a result with matplotlib and returns the axes, an array of them for several panels.

    what  : Modes (eigenvalues with their error discs); a Branch (signals over its parameter,
            dashed where unstable, with its events); a Trajectory or Flight (signals over time); a
            Bode; Margins, of all loops or one (Bode diagrams of L); an Envelope (its boundary, and
            shaded where trims exist); AllEquilibria (their eigenvalues); a Dataset of sweep() over one axis (real parts) or two (verdicts)
    names : signals, of a Branch, Trajectory or Flight; default: every state
    axes  : where to draw; default: a new figure
    """
    if isinstance(what, (LinearModel, TrimResult, Problem, Condition)):
        raise TypeError(f"plot(): of a {type(what).__name__} plot its modes(...) or bode(...)")
    if isinstance(what, Modes):
        return _modes(what, _axes(1, axes)[0])
    if isinstance(what, Bode):
        return _bode(what, _axes(2, axes))
    if isinstance(what, (LoopMargins, Margins)):
        loops = [what] if isinstance(what, LoopMargins) else list(what.loops.values())
        return _loops(loops, _axes(2, axes))
    if isinstance(what, Envelope):
        return _envelope(what, _axes(1, axes)[0])
    if isinstance(what, AllEquilibria):
        return _equilibria(what, _axes(1, axes)[0])
    if isinstance(what, Branch):
        chosen = names or [s.name for s in what.model.states]
        return _branch(what, chosen, _axes(len(chosen), axes))
    if isinstance(what, Trajectory):
        chosen = names or [s.name for s in what.model.states]
        m = what.model
        signals = (*m.states, *m.inputs, *m.parameters, *m.outputs)
        return _motion(what, what.t, {s.name: s.unit for s in signals}, chosen, axes)
    if isinstance(what, Flight):
        chosen = names or ["V", "gamma_deg", "theta_deg", "eta_deg"]
        return _motion(what, what["time"], what.units, chosen, axes)
    if hasattr(what, "spectral_abscissa"):
        return _map(what, _axes(1, axes)[0])
    raise TypeError(f"plot(): expected a result, got {type(what).__name__}")


def _axes(count: int, given: Any) -> Any:
    if given is not None:
        panels = np.atleast_1d(np.asarray(given, dtype=object)).ravel()
        if len(panels) != count:
            raise _tiltrim.InvalidArgument(f"axes: expected {count}, got {len(panels)}")
        return panels
    pyplot = need("matplotlib.pyplot", "matplotlib", "plot()")
    size = (6.4, 4.0 if count == 1 else 1.2 + 1.7 * count)
    _, panels = pyplot.subplots(count, 1, sharex=True, figsize=size, layout="constrained")
    return np.atleast_1d(np.asarray(panels, dtype=object))


def _one(panels: Any) -> Any:
    return panels if len(panels) > 1 else panels[0]


def _label(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _modes(modes: Modes, ax: Any) -> Any:
    values = modes.eigenvalues
    circle = need("matplotlib.patches", "matplotlib", "plot()").Circle
    for z, error in zip(values, modes.error):
        if np.isfinite(error):
            ax.add_patch(circle((z.real, z.imag), error, color=BLUE, alpha=0.2, linewidth=0))
    ax.axvline(0, color="black", linewidth=0.8)
    ax.plot(values.real, values.imag, "x", color=BLUE)
    for mode in modes.modes:
        if mode.eigenvalue.imag >= 0 and mode.name:
            place = (mode.eigenvalue.real, mode.eigenvalue.imag)
            ax.annotate(mode.name, place, xytext=(4, 4), textcoords="offset points", fontsize=8)
    ax.set_xlabel("Re λ [1/s]")
    ax.set_ylabel("Im λ [rad/s]")
    ax.set_title(modes.verdict)
    return ax


def _bode(bode: Bode, panels: Any) -> Any:
    gain, phase = panels
    gain.loglog(bode.frequency, bode.magnitude, color=BLUE)
    gain.set_ylabel(_label(f"|{bode.output}/{bode.input}|", bode.unit))
    phase.semilogx(bode.frequency, np.degrees(bode.phase), color=BLUE)
    phase.set_ylabel("phase [°]")
    phase.set_xlabel("frequency [rad/s]")
    for panel in panels:
        panel.grid(True, which="both", alpha=0.3)
    return panels


def _loops(loops: Sequence[LoopMargins], panels: Any) -> Any:
    gain, phase = panels
    for loop in loops:
        if loop.in_use:
            gain.loglog(loop.frequency, loop.magnitude, label=loop.name)
            phase.semilogx(loop.frequency, np.degrees(loop.phase_of), label=loop.name)
    gain.axhline(1, color="black", linewidth=0.8)
    gain.set_ylabel("|L|")
    phase.set_ylabel("phase of L [°]")
    phase.set_xlabel("frequency [rad/s]")
    for panel in panels:
        panel.grid(True, which="both", alpha=0.3)
    if gain.lines:
        gain.legend()
    return panels


def _envelope(envelope: Envelope, ax: Any) -> Any:
    colors = need("matplotlib.colors", "matplotlib", "plot()")
    shades = colors.ListedColormap(["white", "#b7d7ea"])
    for part in envelope.parts:
        x = np.linspace(*part.along, part.count.shape[0])
        y = np.linspace(*part.over, part.count.shape[1])
        there = (part.count > 0).T
        ax.pcolormesh(x, y, there, cmap=shades, vmin=0, vmax=1, shading="nearest")
    causes = sorted({piece.name for piece in envelope.pieces})
    for cause in causes:
        color, label = f"C{causes.index(cause)}", cause
        for piece in (piece for piece in envelope.pieces if piece.name == cause):
            ax.plot(piece.along, piece.over, color=color, label=label)
            label = "_"  # once in the legend
    ax.set_xlabel(_label(envelope.along.name, envelope.along.unit))
    ax.set_ylabel(_label(envelope.over.name, envelope.over.unit))
    if causes:
        ax.legend()
    return ax


def _equilibria(found: AllEquilibria, ax: Any) -> Any:
    ax.axvline(0, color="black", linewidth=0.8)
    for i, one in enumerate(found):
        if one.modes is not None:
            values = one.modes.eigenvalues
            ax.plot(values.real, values.imag, "x", label=f"{i + 1}: {one.modes.verdict}")
    ax.set_xlabel("Re λ [1/s]")
    ax.set_ylabel("Im λ [rad/s]")
    if len(found):
        ax.legend()
    return ax


def _pieces(states: Any) -> List[Tuple[slice, bool]]:
    """Stretches of equal values, each with the first point of the next."""
    ends = [*(np.flatnonzero(np.diff(states)) + 1), len(states)]
    begins = [0, *ends[:-1]]
    return [(slice(b, min(e + 1, len(states))), bool(states[b])) for b, e in zip(begins, ends)]


def _branch(branch: Branch, names: Sequence[str], panels: Any) -> Any:
    unstable = branch.unstable > 0
    parameter = branch.parameter
    marks = {"fold": "o", "hopf": "s", "zero": "D", "branch_point": "P", "limit": "^"}
    for panel, name in zip(panels, names):
        values = branch[name]
        for piece, lost in _pieces(unstable):
            style = "--" if lost else "-"
            panel.plot(branch.values[piece], values[piece], style, color=RED if lost else BLUE)
        for event in branch.events:
            if event.kind in marks and name in event.point:
                place = (event.parameter, event.point[name])
                panel.plot(*place, marks[event.kind], color="black", markersize=5)
        panel.set_ylabel(_label(name, _unit_of(branch, name)))
    panels[-1].set_xlabel(_label(parameter.name, parameter.unit))
    panels[0].set_title(f"{branch.model.name}: {branch.end}; dashed: unstable")
    return _one(panels)


def _unit_of(branch: Branch, name: str) -> str:
    m = branch.model
    return next(
        s.unit for s in (*m.states, *m.inputs, *m.parameters, *m.outputs) if s.name == name
    )


def _motion(
    what: Union[Trajectory, Flight],
    time: Array,
    units: Dict[str, str],
    names: Sequence[str],
    axes: Any,
) -> Any:
    columns = [what[name] for name in names]  # raises, with the names there are
    panels = _axes(len(names), axes)
    for panel, name, values in zip(panels, names, columns):
        panel.plot(time, values, color=BLUE)
        panel.set_ylabel(_label(name, units[name]))
    panels[-1].set_xlabel("time [s]")
    panels[0].set_title(what.status)
    return _one(panels)


def _map(dataset: Any, ax: Any) -> Any:
    over = [d for d in dataset.spectral_abscissa.dims if d != "condition"]
    if dataset.spectral_abscissa.ndim != len(over):
        raise _tiltrim.InvalidArgument("plot(): choose one condition, ds.isel(condition=0)")
    if len(over) == 1:
        return _lines(dataset, over[0], ax)
    if len(over) == 2:
        return _areas(dataset, over, ax)
    raise _tiltrim.InvalidArgument(f"plot(): a map of {len(over)} axes; choose a line or a plane")


def _axis_label(dataset: Any, name: str) -> str:
    return _label(name, str(dataset[name].attrs.get("study_unit", "")))


def _lines(dataset: Any, axis: str, ax: Any) -> Any:
    ax.plot(dataset[axis], dataset.eigenvalue.values.real, color=BLUE, linewidth=1)
    low, high = ax.get_ylim()
    unstable = dataset.verdict.values == "unstable"
    ax.fill_between(dataset[axis], low, high, where=unstable, color=RED, alpha=0.2, linewidth=0)
    ax.set_ylim(low, high)
    ax.axhline(0, color="black", linewidth=0.8)
    ax.set_xlabel(_axis_label(dataset, axis))
    ax.set_ylabel("Re λ [1/s]")
    return ax


def _areas(dataset: Any, over: Sequence[str], ax: Any) -> Any:
    colors = need("matplotlib.colors", "matplotlib", "plot()")
    words = ["", "stable", "undecided", "unstable"]
    numbers = np.array([words.index(v) for v in dataset.verdict.values.ravel()])
    shades = colors.ListedColormap(["white", "#b7d7ea", GREY, "#f0b090"])
    x, y = over[1], over[0]
    ax.pcolormesh(
        dataset[x], dataset[y], numbers.reshape(dataset.verdict.shape), cmap=shades,
        vmin=-0.5, vmax=3.5, shading="nearest",
    )  # fmt: skip
    along = dataset.crossing_at
    if along.sizes.get("crossing", 0):
        axes = list(dataset["axis"].values)
        at = along.values
        ax.plot(at[:, axes.index(x)], at[:, axes.index(y)], ".", color="black", markersize=2)
    ax.set_xlabel(_axis_label(dataset, x))
    ax.set_ylabel(_axis_label(dataset, y))
    ax.set_title("blue: stable, red: unstable, white: no trim")
    return ax
