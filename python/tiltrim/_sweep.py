"""sweep: trims, linear models and modes over a grid, and the verdict between its points."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _tiltrim
from ._arguments import MOST_THREADS, listed_names, mapping, whole
from ._follow import _signal
from ._models import Array, Model
from ._maps import to_dataset
from ._needs import need
from ._problems import Guess, Problem, TrimFields, TrimSpec, shows_fields, spec_of
from ._progress import Progress, Tell, told
from ._studies import Condition, Study, StudyLike, _toml_value, parse_study, read_study
from ._trim import TrimResult, asked, time_limited

if TYPE_CHECKING:
    import xarray
    from typing_extensions import Unpack

#: {signal: values}, or {axis name: {signal: values, ...}} for signals that vary together
Axes = Mapping[str, Union[ArrayLike, Mapping[str, ArrayLike]]]
Problems = Sequence[Union[Problem, Condition, TrimResult]]


@shows_fields
def sweep(
    what: Union[Model, Problem, Condition, TrimResult, StudyLike, Problems],
    guess: Optional[Guess] = None,
    *,
    axes: Optional[Axes] = None,
    spec: Optional[TrimSpec] = None,
    inputs: Sequence[str] = (),
    only: Sequence[str] = (),
    crossings: bool = True,
    threads: int = 0,
    starts: int = 8,
    method: str = "ipopt",
    time_limit: Optional[float] = None,
    progress: Progress = None,
    **fields: Unpack[TrimFields],
) -> xarray.Dataset:
    """Eigenvalues over a grid, and every crossing of the stability boundary between its points.

    what  : a Model with a guess and a trim specification; a Problem or a Condition; a list of
            those, with the same states; or a Study or its path, with [[sweep.axis]] of its own or
            without, and axes
    axes  : {signal: values}: variables that the trim does not solve for, the first slowest.
            Signals that vary together are one axis: {"h": {"V": [...], "eta": [...]}}. For
            Conditions, keys of a study, in its units: "V", "eta_deg", "gains.K_Lp", "h"
    inputs: inputs or outputs of the model to store with the state; default: its inputs
    only  : conditions of a study, by name; default: all. Refused for anything else
    crossings : look between the grid's points
    threads   : 0: as many as the machine has. Models with Python callables are swept by one
    starts, method, time_limit : of the trim from nothing, where Newton from the neighboring point fails;
             s of wall clock each, default: none, or the study's
    progress : True, or progress(done, total, text). An exception from it ends the sweep; if it
             returns False, the sweep stops with the lines that are finished: the other points have
             the status "not_reached", and the attribute `interrupted` counts them

    Returns an xarray.Dataset over the axes (and `condition`, for a study or a list):

    status, verdict, reason       : text; verdict is "" without an equilibrium
    eigenvalue (..., mode)        : complex, 1/s, modes tracked from point to point; mode_name
    state_value (..., state), input_value (..., input) : at the equilibrium; else NaN
    spectral_abscissa, damping, residual, confidence, second_branch
    crossing_...  (crossing)      : where the number of unstable eigenvalues changes along an axis
    interval_...  (interval)      : verdicts for whole intervals between the points
    second_...    (second)        : the equilibria of second branches

    save() writes it to the file that `tiltrim sweep -o map.nc` writes; the variables have the same
    names and attributes in both.

    Needs xarray. Raises ValueError for unknown names.
    """
    own = spec_of("sweep", spec, fields)
    xr = need("xarray", "xarray", "sweep()")
    options = {
        "threads": whole("threads", threads, MOST_THREADS),
        "crossings": bool(crossings),
        "trimming": {"starts": starts, "method": method, **time_limited(time_limit)},
    }
    if isinstance(what, (str, os.PathLike)):
        what = read_study(what)
    only = listed_names("only", only)
    if only and not isinstance(what, Study):
        raise TypeError(
            f"sweep(): only= names conditions of a study; {type(what).__name__} has none"
        )
    if isinstance(what, Study) and axes is not None and not what._core.has_axes:
        what = [what[name] for name in only or what.conditions]
    if isinstance(what, Study):
        if axes is not None:
            raise TypeError("sweep() of a study: its axes are its own; expected no axes=")
        for name in only:
            what[name]  # raises, with the names there are
        with told(progress) as tell:
            return to_dataset(xr, _tiltrim.sweep_study(what._core, list(only), options, tell))
    single = isinstance(what, (Model, Problem, Condition, TrimResult))
    members = [what] if isinstance(what, (Model, Problem, Condition, TrimResult)) else list(what)
    axes = mapping("axes", axes, "{signal: values}")
    if not axes or not members:
        raise TypeError("sweep() needs axes={signal: values} and a problem")
    conditions = [one for one in members if isinstance(one, Condition)]
    with told(progress) as tell:
        if len(conditions) == len(members):
            return to_dataset(xr, _sweep_conditions(conditions, axes, options, tell), single)
        problems = [_problem(one, guess, own, inputs) for one in members]
        raw = _tiltrim.sweep(problems, _axes(axes, _first_model(members)), options, tell)
    return to_dataset(xr, raw, single, raw["exception"])


def _sweep_conditions(
    conditions: Sequence[Condition], axes: Axes, options: Dict[str, Any], tell: Optional[Tell]
) -> Dict[str, Any]:
    # As a study with these axes: its keys, units and checks apply.
    study = conditions[0].study
    if any(one.study.text != study.text for one in conditions):
        raise TypeError("sweep(): expected conditions of one study")
    if study._core.has_axes:
        raise TypeError("sweep(): the study has axes of its own; expected sweep(study, only=[...])")
    text = study.text + "".join(_axis_as_toml(name, values) for name, values in axes.items())
    own = parse_study(text, study.file)
    return _tiltrim.sweep_study(own._core, [one.name for one in conditions], options, tell)


def _axis_as_toml(name: str, values: Any) -> str:
    together = dict(values) if isinstance(values, Mapping) else {name: values}
    tables = [
        f"key = {_toml_value(key)}, values = {_toml_value(_numbers(name, key, column).tolist())}"
        for key, column in together.items()
    ]
    first = tables[0].replace(", values", "\nvalues", 1)
    coupled = ", ".join(f"{{{table}}}" for table in tables[1:])
    return f"\n[[sweep.axis]]\n{first}\n" + (f"with = [{coupled}]\n" if coupled else "")


def _numbers(axis: str, signal: str, given: Any) -> Array:
    column = np.asarray(given)
    if column.dtype.kind not in "fiu" or column.ndim != 1 or column.size == 0:
        raise _tiltrim.InvalidArgument(
            f"axis '{axis}': expected a list of numbers for '{signal}', got {given!r}"
        )
    return column.astype(float)


def _first_model(members: Sequence[Union[Model, Problem, Condition, TrimResult]]) -> Model:
    first = members[0]
    return first if isinstance(first, Model) else first.model


def _problem(
    what: Union[Model, Problem, Condition, TrimResult],
    guess: Optional[Guess],
    spec: TrimSpec,
    inputs: Sequence[str],
    verb: str = "sweep",
) -> Tuple[str, _tiltrim.Model, Dict[str, Any], Any, List[str]]:
    if isinstance(what, TrimResult):
        what = what._problem()
    model, own, at = asked(what, guess, spec, verb)
    kept = list(inputs) or [s.name for s in model.inputs]
    return what.name, model._core, own._fields(), at._tuple(), kept


def _axes(axes: Axes, model: Model) -> List[Tuple[str, List[Tuple[str, str, List[float]]]]]:
    listed = []
    for name, values in axes.items():
        together = values if isinstance(values, Mapping) else {name: values}
        columns = []
        for signal, numbers in together.items():
            column = _numbers(name, signal, numbers).tolist()
            columns.append((signal, _signal(model, signal).unit, column))
        if len({len(column) for _, _, column in columns}) != 1:
            raise _tiltrim.InvalidArgument(f"axis '{name}': unequal numbers of values")
        listed.append((name, columns))
    return listed
