"""Trim, linear stability, maps, tuning and simulation of user-defined models and the tiltrotor.

A Model has names, units and functions x' = f(x, u, p), y = h(x, u, p); tiltrotor() and read_study()
return conditions of the built-in vehicle. The verbs: trim, follow, linearize, modes, margins,
envelope, all_equilibria, sweep, tune, simulate, fly, monte_carlo, report; of linear models lqr,
place, hinf_norm, h2_norm, lyapunov. SI units and radians,
degrees where a name ends in _deg.
"""

from __future__ import annotations

from ._design import (
    EquationSolution,
    H2Norm,
    Peak,
    Placement,
    Regulator,
    h2_norm,
    hinf_norm,
    lqr,
    lyapunov,
    place,
)
from ._envelope import Envelope, EnvelopePart, EnvelopePiece, envelope
from ._equilibria import AllEquilibria, Equilibrium, all_equilibria
from ._follow import Branch, BranchEvent, follow
from ._linear import Bode, LinearModel, Mode, Modes, bode, linearize, modes
from ._maps import open_map, save
from ._margins import LoopMargins, Margins, margins
from ._models import Effort, Model, Point, Signal, close_loop, feedback
from ._monte_carlo import MonteCarlo, ScatteredFlight, monte_carlo
from ._plot import plot
from ._problems import Problem, TrimSpec
from ._prove import ProvedRegion, Theorem, prove
from ._qualities import Criterion, Qualities, qualities
from ._report import Report, report
from ._sensitivities import ParameterSensitivity, Sensitivities, sensitivities
from ._simulate import Change, Flight, SwitchEvent, Trajectory, fly, simulate
from ._studies import (
    Condition,
    NoLinearModel,
    Study,
    data_directory,
    parse_study,
    read_study,
    tiltrotor,
)
from ._sweep import sweep
from ._tiltrim import InvalidArgument, StudyError
from ._tiltrim import version as __version__
from ._trim import TrimResult, trim
from ._tune import Achieved, FrontPoint, GainEffect, Robustness, TuneResult, tune

__all__ = [
    "Achieved",
    "AllEquilibria",
    "Bode",
    "Branch",
    "BranchEvent",
    "Change",
    "Condition",
    "Criterion",
    "Effort",
    "Envelope",
    "EnvelopePart",
    "EnvelopePiece",
    "EquationSolution",
    "Equilibrium",
    "Flight",
    "FrontPoint",
    "GainEffect",
    "H2Norm",
    "InvalidArgument",
    "LinearModel",
    "LoopMargins",
    "Margins",
    "Mode",
    "Model",
    "Modes",
    "MonteCarlo",
    "NoLinearModel",
    "ParameterSensitivity",
    "Peak",
    "Placement",
    "Point",
    "Problem",
    "ProvedRegion",
    "Qualities",
    "Regulator",
    "Report",
    "Robustness",
    "ScatteredFlight",
    "Sensitivities",
    "Signal",
    "Study",
    "StudyError",
    "SwitchEvent",
    "Theorem",
    "Trajectory",
    "TrimResult",
    "TrimSpec",
    "TuneResult",
    "all_equilibria",
    "bode",
    "close_loop",
    "data_directory",
    "envelope",
    "feedback",
    "fly",
    "follow",
    "h2_norm",
    "hinf_norm",
    "linearize",
    "lqr",
    "lyapunov",
    "margins",
    "modes",
    "monte_carlo",
    "open_map",
    "parse_study",
    "place",
    "plot",
    "prove",
    "qualities",
    "read_study",
    "report",
    "save",
    "sensitivities",
    "simulate",
    "sweep",
    "tiltrotor",
    "trim",
    "tune",
]
