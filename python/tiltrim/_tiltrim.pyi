"""The compiled module: tuples, dictionaries and arrays, named by the package's Python code."""

from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
_Signal = Tuple[str, str, float]
_Point = Tuple[_Array, _Array, _Array]
_Range = Tuple[float, float]
_Problem = Tuple[str, "Model", Dict[str, Any], _Point, List[str]]
_Axis = Tuple[str, List[Tuple[str, str, List[float]]]]
_EnvelopeAxis = Tuple[str, float, float, int]
_Progress = Optional[Callable[[int, int, str], Any]]

version: str

class InvalidArgument(ValueError):
    """Invalid arguments; the message says what was expected."""

class StudyError(ValueError):
    """A study that cannot be read: file, line, column, key, what is wrong."""

class Model:
    def __init__(
        self,
        name: str,
        f: Optional[Callable[..., Any]],
        h: Optional[Callable[..., Any]],
        states: Sequence[_Signal],
        inputs: Sequence[_Signal],
        outputs: Sequence[_Signal],
        parameters: Sequence[_Signal],
        derivatives: Optional[Callable[..., Any]],
        switches: Sequence[Tuple[str, Callable[..., Any]]],
        vectorized: bool = False,
        lanes: Optional[Callable[..., Any]] = None,
    ) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def states(self) -> List[_Signal]: ...
    @property
    def inputs(self) -> List[_Signal]: ...
    @property
    def outputs(self) -> List[_Signal]: ...
    @property
    def parameters(self) -> List[_Signal]: ...
    @property
    def callables(self) -> bool: ...
    @property
    def exact(self) -> bool: ...

class Study:
    @property
    def conditions(self) -> List[Condition]: ...
    @property
    def file(self) -> str: ...
    @property
    def text(self) -> str: ...
    @property
    def has_axes(self) -> bool: ...
    @property
    def follow(self) -> Optional[Tuple[str, float]]: ...

class Condition:
    @property
    def name(self) -> str: ...
    @property
    def place(self) -> str: ...
    @property
    def formulation(self) -> str: ...
    @property
    def study(self) -> Study: ...
    def problem(self) -> Tuple[Model, Dict[str, Any], _Point]: ...

def data_directory() -> str: ...
def feedback(plant: Model, controller: Model) -> Model: ...
def variable(model: Model, name: str) -> int: ...
def evaluate(model: Model, point: _Point) -> Tuple[_Array, _Array]: ...
def trim(
    model: Model, spec: Dict[str, Any], guess: _Point, options: Dict[str, Any]
) -> Dict[str, Any]: ...
def follow(
    model: Model,
    spec: Dict[str, Any],
    start: _Point,
    parameter: str,
    to: float,
    options: Dict[str, Any],
) -> Dict[str, Any]: ...
def linearize(
    model: Model,
    point: _Point,
    method: str,
    inputs: Sequence[str],
    bounds: Dict[str, _Range],
    tolerance: float,
    moving: Sequence[str],
    time_limit: float,
) -> Dict[str, Any]: ...
def modes(A: _Array, A_error: _Array, states: Sequence[str]) -> Dict[str, Any]: ...
def sensitivities(
    model: Model, spec: Dict[str, Any], point: _Point, parameters: Sequence[str]
) -> Dict[str, Any]: ...
def sweep(
    problems: Sequence[_Problem],
    axes: Sequence[_Axis],
    options: Dict[str, Any],
    progress: _Progress,
) -> Dict[str, Any]: ...
def map_fields() -> Dict[str, Any]: ...
def open_map(file: str) -> Dict[str, Any]: ...
def save_map(map: Dict[str, Any], file: str) -> None: ...
def tune(
    problems: Sequence[_Problem],
    asked: Dict[str, Any],
    options: Dict[str, Any],
    progress: _Progress,
) -> Dict[str, Any]: ...
def read_study(file: str) -> Study: ...
def parse_study(text: str, name: str) -> Study: ...
def angle_remarks(study: Study) -> List[str]: ...
def trim_condition(condition: Condition, options: Dict[str, Any]) -> Dict[str, Any]: ...
def follow_condition(
    condition: Condition,
    parameter: str,
    to: float,
    options: Dict[str, Any],
    trimming: Dict[str, Any],
) -> Dict[str, Any]: ...
def sensitivities_condition(
    condition: Condition, parameters: Sequence[str], trimming: Dict[str, float]
) -> Dict[str, Any]: ...
def sweep_study(
    study: Study, only: Sequence[str], options: Dict[str, Any], progress: _Progress
) -> Dict[str, Any]: ...
def tune_study(study: Study, options: Dict[str, Any], progress: _Progress) -> Dict[str, Any]: ...
def tune_conditions(
    conditions: Sequence[Condition],
    asked: Dict[str, Any],
    options: Dict[str, Any],
    progress: _Progress,
) -> Dict[str, Any]: ...
def fly_study(study: Study, number: Optional[int]) -> Dict[str, Any]: ...
def monte_carlo(study: Study, threads: int, progress: _Progress) -> Dict[str, Any]: ...
def prove(
    study: Study,
    only: Sequence[str],
    margin: Optional[float],
    damping: Optional[float],
    boxes: Optional[int],
    threads: int,
    progress: _Progress,
) -> Tuple[str, List[str]]: ...
def qualities_condition(condition: Condition, trimming: Dict[str, float]) -> str: ...
def qualities(
    linear: Dict[str, Any],
    roles: Dict[str, str],
    words: Tuple[str, str, str, str],
    airspeed: float,
    gravity: float,
    n_per_alpha: float,
    bandwidth: Sequence[Sequence[Tuple[float, float]]],
) -> str: ...
def margins_condition(
    condition: Condition,
    loops: Sequence[str],
    lowest: Optional[float],
    highest: Optional[float],
    points: int,
    trimming: Dict[str, float],
) -> Dict[str, Any]: ...
def margins(
    name: str,
    A: _Array,
    b: _Array,
    c: _Array,
    d: float,
    closed: bool,
    lowest: float,
    highest: float,
    points: int,
) -> Dict[str, Any]: ...
def lqr(A: _Array, B: _Array, Q: _Array, R: _Array) -> Dict[str, Any]: ...
def place(A: _Array, B: _Array, poles: NDArray[np.complex128]) -> Dict[str, Any]: ...
def lyapunov(A: _Array, Q: _Array) -> Dict[str, Any]: ...
def hinf_norm(
    A: _Array, B: _Array, C: _Array, D: _Array, tolerance: float, max_levels: int
) -> Dict[str, Any]: ...
def h2_norm(A: _Array, B: _Array, C: _Array, D: _Array) -> Tuple[float, float]: ...
def envelope(
    model: Model,
    spec: Dict[str, Any],
    guess: _Point,
    along: _EnvelopeAxis,
    over: _EnvelopeAxis,
    rows: Sequence[float],
    progress: _Progress,
) -> Dict[str, Any]: ...
def envelope_condition(
    condition: Condition,
    over: str,
    count: Optional[int],
    rows: Optional[Sequence[float]],
    progress: _Progress,
) -> Dict[str, Any]: ...
def envelope_model(condition: Condition) -> Model: ...
def all_equilibria(
    model: Model,
    spec: Dict[str, Any],
    guess: _Point,
    parameters: Sequence[str],
    reach: float,
    options: Dict[str, Any],
) -> Dict[str, Any]: ...
def all_equilibria_condition(condition: Condition, options: Dict[str, Any]) -> Dict[str, Any]: ...
def report(
    study: Study,
    file: str,
    only: Sequence[str],
    maps: Sequence[str],
    figures: str,
    tables: str,
    threads: int,
) -> Tuple[str, bool]: ...
def simulate(
    model: Model,
    start: _Point,
    duration: float,
    changes: Sequence[Tuple[str, float, float, float]],
    input: Optional[Callable[[float], Any]],
    breaks: Sequence[float],
    options: Dict[str, Any],
) -> Dict[str, Any]: ...
