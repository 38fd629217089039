"""sensitivities: derivatives of a trim and its modes along every parameter, with re-trimming."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

from . import _tiltrim
from ._arguments import listed_names
from ._linear import Complex, Modes, _modes
from ._models import Array, Model, Point, Signal
from ._problems import Problem
from ._show import Page, Shown, Table, number
from ._studies import Condition, _model_of, of_studies
from ._trim import TrimResult, time_limited, trim


@dataclass(repr=False)
class ParameterSensitivity(Shown):
    """Derivatives along one parameter, per unit of it."""

    parameter: Signal
    value: float
    x: Array  #: of the trim's states, shape (nx,)
    u: Array  #: of its inputs, shape (nu,)
    outputs: Array  #: shape (ny,)
    eigenvalue: Complex  #: of each mode; NaN if not differentiable
    damping: Array
    frequency: Array
    error: Array  #: estimated error of the eigenvalue derivative

    def _page(self) -> Page:
        unit = f" {self.parameter.unit}" if self.parameter.unit else ""
        return Page(f"along {self.parameter.name} = {number(self.value)}{unit}")


@dataclass(repr=False)
class Sensitivities(Shown):
    """Derivatives of a trim and its modes: sensitivities["mass"] holds those along one parameter.

    True if the status is "found".
    """

    status: str  #: found, not_trim, not_implied, singular, no_linear
    message: str
    point: Point
    rcond: float
    modes: Modes
    simple: List[bool]  #: the mode is isolated, hence differentiable
    parameters: List[ParameterSensitivity]
    ranked: List[List[int]]  #: for each mode: indices of parameters, most influential first

    def __bool__(self) -> bool:
        return self.status == "found"

    def __getitem__(self, name: str) -> ParameterSensitivity:
        for one in self.parameters:
            if one.parameter.name == name:
                return one
        known = ", ".join(one.parameter.name for one in self.parameters)
        raise _tiltrim.InvalidArgument(f"no sensitivities to '{name}'; there are: {known}")

    def _page(self) -> Page:
        most = 5
        tables = []
        for i, mode in enumerate(self.modes.modes):
            if not self or mode.eigenvalue.imag < 0:
                continue
            rows = [
                [
                    p.parameter.name,
                    number(p.value),
                    _percent(p.value, p.eigenvalue[i].real),
                    _percent(p.value, p.damping[i]),
                ]
                for p in (self.parameters[k] for k in self.ranked[i][:most])
            ]
            headings = [f"+1 % of ({mode.name})", "value", "real part", "damping"]
            tables.append(Table(headings, rows, ["", "", "1/s", ""], left=(0,)))
        return Page(self.status, [self.message], tables)


def _percent(value: float, derivative: float) -> str:
    return "-" if math.isnan(derivative) else f"{0.01 * value * derivative:+.2e}"


@of_studies
def sensitivities(
    what: Union[TrimResult, Problem, Condition],
    parameters: Sequence[str] = (),
    *,
    time_limit: Optional[float] = None,
) -> Sensitivities:
    """Derivatives of a trim and its modes along parameters, including the shift of the trim.

    what       : a TrimResult; a Problem or a Condition, which are trimmed first; or a Study or its
                 path: {name: sensitivities}, or those of condition=
    parameters : states, inputs or parameters that the trim does not move, for a Condition keys of
                 a study too, as "eta_deg"; default: all parameters of the model that are left
    time_limit : of that trim, s of wall clock

    Raises ValueError for unknown names (docs/follow.md).
    """
    parameters = listed_names("parameters", parameters)
    if isinstance(what, Condition):
        limit = time_limited(time_limit)
        raw = _tiltrim.sensitivities_condition(what._core, list(parameters), limit)
        return _sensitivities(raw, Model._of(raw["model"], (_model_of, (what,))))
    held = what if isinstance(what, TrimResult) else trim(what, time_limit=time_limit)
    raw = _tiltrim.sensitivities(
        held.model._core, held.spec._fields(), held.point._tuple(), list(parameters)
    )
    return _sensitivities(raw, held.model)


def _sensitivities(raw: Dict[str, Any], model: Model) -> Sensitivities:
    names: Tuple[str, ...] = tuple(s.name for s in model.states)
    for one in raw["parameters"]:
        one["parameter"] = Signal(*one["parameter"])
    return Sensitivities(
        status=raw["status"],
        message=raw["message"],
        point=Point(model, *raw["point"]),
        rcond=raw["rcond"],
        modes=_modes(raw["modes"], names),
        simple=list(raw["simple"]),
        parameters=[ParameterSensitivity(**one) for one in raw["parameters"]],
        ranked=[list(one) for one in raw["ranked"]],
    )
