"""Studies of the tiltrotor or of a [model] written as formulas, and their conditions."""

from __future__ import annotations

import difflib
import functools
import inspect
import os
import warnings
from types import MappingProxyType
from typing import (
    TYPE_CHECKING,
    Any,
    Callable,
    Dict,
    List,
    Mapping,
    Optional,
    Protocol,
    Sequence,
    Tuple,
    TypeVar,
    Union,
    overload,
)

from . import _tiltrim
from ._models import Effort, Model, Point, point_table
from ._problems import TrimSpec
from ._show import Page, Shown

if TYPE_CHECKING:
    from typing_extensions import ParamSpec

    P = ParamSpec("P")
    R = TypeVar("R")

    class OfStudies(Protocol[P, R]):
        """A verb on a condition that takes studies too."""

        @overload
        def __call__(self, what: StudyLike, *args: Any, condition: str, **options: Any) -> R: ...
        @overload
        def __call__(
            self, what: StudyLike, *args: Any, condition: None = None, **options: Any
        ) -> Dict[str, R]: ...
        @overload
        def __call__(self, *args: P.args, **options: P.kwargs) -> R: ...


Number = Union[int, float]


class Condition(Shown):
    """A condition of a study: it has `model`, `spec` and `guess` like a Problem, and every verb
    accepts it. SI units and radians, or the units of the study's [model]."""

    def __init__(self, core: _tiltrim.Condition) -> None:
        self._core = core
        self._problem: Optional[Tuple[Model, TrimSpec, Point]] = None

    def __reduce__(self) -> Tuple[Any, ...]:
        study = self._core.study
        return _condition_of, (study.text, study.file, self.name)

    @property
    def name(self) -> str:
        """The condition's name in its study."""
        return self._core.name

    @property
    def formulation(self) -> str:
        """closed_loop, airframe or table; model for a study with [model] (docs/study.md)."""
        return self._core.formulation

    @property
    def study(self) -> Study:
        """The study it belongs to."""
        return Study(self._core.study)

    def _asked(self) -> Tuple[Model, TrimSpec, Point]:
        if self._problem is None:
            core, spec, (x, u, p) = self._core.problem()
            model = Model._of(core, (_model_of, (self,)))
            spec["effort"] = tuple(Effort(*e) for e in spec["effort"])
            self._problem = (model, TrimSpec(**spec), Point(model, x, u, p))
        return self._problem

    @property
    def model(self) -> Model:
        """The model to trim: the closed loop, or the airframe."""
        return self._asked()[0]

    @property
    def spec(self) -> TrimSpec:
        """The trim specification."""
        return self._asked()[1]

    @property
    def guess(self) -> Point:
        """The initial guess of its trim; a copy."""
        return self._asked()[2].copy()

    def _page(self) -> Page:
        if self.formulation == "table":
            return Page(f"condition {self.name}: table")
        model, spec, guess = self._asked()
        notes = {name: "free" for name in spec.free}
        return Page(
            f"condition {self.name}: {model.name}",
            ["steady: " + ", ".join(spec.steady)],
            [point_table(guess, notes)],
        )


class Study(Shown):
    """A study of the tiltrotor or of its own [model]: conditions by name, and analyses."""

    def __init__(self, core: _tiltrim.Study) -> None:
        self._core = core
        self._conditions = {c.name: Condition(c) for c in core.conditions}

    def __reduce__(self) -> Tuple[Any, ...]:
        return parse_study, (self.text, self.file)

    @property
    def conditions(self) -> Mapping[str, Condition]:
        """The conditions by name, in the study's order."""
        return MappingProxyType(self._conditions)

    def __getitem__(self, name: str) -> Condition:
        """The condition of this name."""
        if name not in self._conditions:
            near = difflib.get_close_matches(name, self._conditions, 1)
            nearest = f" (nearest: '{near[0]}')" if near else ""
            raise _tiltrim.InvalidArgument(
                f"{self.file}: no condition '{name}'{nearest}; there are: "
                + ", ".join(self._conditions)
            )
        return self._conditions[name]

    @property
    def file(self) -> str:
        """The path it was read from."""
        return self._core.file

    @property
    def text(self) -> str:
        """The text of the study, TOML."""
        return self._core.text

    def _page(self) -> Page:
        lines = [f"{name}: {c.formulation}" for name, c in self._conditions.items()]
        return Page(f"study {self.file}", lines)


def read_study(path: Union[str, os.PathLike[str]]) -> Study:
    """Reads and checks a study file (docs/study.md); StudyError has file, line, column and key.

    Warns of angles that appear to be in the other unit: gamma_deg = 1.5708.
    """
    return _remarked(_tiltrim.read_study(os.fspath(path)))


def parse_study(text: str, name: str = "study") -> Study:
    """The same from text; `name` replaces the file name in messages."""
    return _remarked(_tiltrim.parse_study(text, name))


def _remarked(core: _tiltrim.Study) -> Study:
    for remark in _tiltrim.angle_remarks(core):
        warnings.warn(remark, stacklevel=3)
    return Study(core)


StudyLike = Union[Study, str, "os.PathLike[str]"]  # a study, or the path of one


def study_of(verb: str, what: Any) -> Study:
    """The study, or the one of a path; a TypeError names the verb and what it was given."""
    if isinstance(what, Study):
        return what
    if not isinstance(what, (str, os.PathLike)):
        raise TypeError(f"{verb}(): expected a Study or its path, not {type(what).__name__}")
    return read_study(what)


class NoLinearModel(_tiltrim.InvalidArgument):
    """A condition without a linear model."""


def of_studies(verb: Callable[P, R]) -> OfStudies[P, R]:
    """Lets a verb on a Condition take a Study or its path: the answer for the condition of
    `condition=`, or all by name, without those that have no linear model where one is needed."""

    @functools.wraps(verb)
    def on_study(what: Any, *args: Any, condition: Optional[str] = None, **options: Any) -> Any:
        if isinstance(what, str) or hasattr(what, "__fspath__"):
            what = read_study(what)
        if not isinstance(what, Study):
            if condition is not None:
                raise TypeError(f"{verb.__name__}(): condition= names one of a study's conditions")
            return verb(what, *args, **options)
        answers: Dict[str, Any] = {}
        for name in what.conditions if condition is None else [condition]:
            one = what[name]
            try:
                answers[name] = verb(one, *args, **options)  # type: ignore[arg-type]
            except NoLinearModel:
                if condition is not None:
                    raise
            except _tiltrim.InvalidArgument as error:
                words = f"{one._core.place}: condition '{name}': {error}"
                raise _tiltrim.InvalidArgument(words) from error
        return answers if condition is None else answers[condition]

    own = inspect.signature(verb)
    name = inspect.Parameter("condition", inspect.Parameter.KEYWORD_ONLY, default=None)
    parameters = [*own.parameters.values()]
    last = len(parameters) - (parameters[-1].kind == inspect.Parameter.VAR_KEYWORD)
    parameters.insert(last, name.replace(annotation="Optional[str]"))
    setattr(on_study, "__signature__", own.replace(parameters=parameters))
    return on_study  # type: ignore[return-value]


def _condition_of(text: str, file: str, name: str) -> Condition:
    return parse_study(text, file).conditions[name]


def _model_of(condition: Condition) -> Model:
    if condition.formulation != "table":
        return condition.model
    raw = _tiltrim.trim_condition(condition._core, {"starts": 0})
    return Model._of(raw["model"], (_model_of, (condition,)))


def tiltrotor(
    V: float = 15.0,
    gamma_deg: float = 0.0,
    eta_deg: float = 0.0,
    *,
    name: str = "condition",
    aircraft: Optional[Mapping[str, Union[Number, str]]] = None,
    gains: Optional[Mapping[str, Number]] = None,
    limits: Optional[Mapping[str, Sequence[Number]]] = None,
    formulation: str = "closed_loop",
    **keys: Any,
) -> Condition:
    """The reference tiltrotor at an airspeed V [m/s], path angle and nacelle tilt [degrees].

    aircraft, gains, limits : values that differ from the reference's, by the keys of a study, such
                              as {"mass": 4.4}, {"K_Lp": 0.9}, {"a1s_deg": (-20, 20)}
    formulation : "closed_loop", with the control law, or "airframe"
    keys        : further keys of the condition (docs/study.md), such as theta_deg=[0, 10]

    Keys that end in _deg are in degrees; the condition's attributes are in SI units and radians.
    Raises StudyError for a key or value that a study would refuse.
    """
    condition: Dict[str, Any] = {"name": name, "V": V, "gamma_deg": gamma_deg, "eta_deg": eta_deg}
    if formulation != "closed_loop":
        condition["formulation"] = formulation
    condition.update(keys)
    lines: List[str] = []
    for table, values in (("aircraft", aircraft), ("gains", gains), ("limits", limits)):
        if values:
            lines += [f"[{table}]", *_toml(values)]
    text = "\n".join([*lines, "[[condition]]", *_toml(condition), ""])
    return next(iter(parse_study(text, "tiltrotor()").conditions.values()))


def _toml(values: Mapping[str, Any]) -> List[str]:
    return [f"{_quoted(str(key))} = {_toml_value(value)}" for key, value in values.items()]


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _toml_value(value: Any) -> str:
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{" + ", ".join(_toml(value)) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml_value(v) for v in value) + "]"
    return repr(int(value)) if isinstance(value, int) else repr(float(value))


def data_directory() -> str:
    """The folder of the polars and published tables shipped with tiltrim."""
    return _tiltrim.data_directory()
