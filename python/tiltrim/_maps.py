"""Maps as datasets and as NetCDF files: one set of variables, defined by the library."""

from __future__ import annotations

import os
import traceback
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Set, Tuple, Union

import numpy as np

from . import _tiltrim
from ._needs import need

if TYPE_CHECKING:
    import xarray

#: dimensions, long_name, units, words for 0, 1, ..., whether -1 is no value, scale, flat values
_Field = Tuple[List[str], str, str, List[str], bool, float, Any]
_ATTRIBUTES = ("program", "instruction_set", "polar", "study")
_NAMED = ("condition", "axis", "state", "input")  # dimensions with names as their coordinate
_NAMES = {f"{dim}_name": dim for dim in _NAMED}
_POSITIONS = {  # variables that are positions in a list, words in a Dataset
    "reason": "reason",
    "crossing_condition": "condition",
    "crossing_axis": "axis",
    "interval_condition": "condition",
    "interval_axis": "axis",
}


def open_map(file: Union[str, os.PathLike[str]]) -> xarray.Dataset:
    """Reads a map that save() or `tiltrim sweep -o map.nc` wrote: a Dataset as of sweep() of a
    study, with the dimension `condition`. Needs xarray.

    Raises OSError for a file that is missing, damaged, or no map.
    """
    xr = need("xarray", "xarray", "open_map()")
    with open(file, "rb"):
        pass  # raises FileNotFoundError, PermissionError
    return to_dataset(xr, _tiltrim.open_map(os.fspath(file)))


def save(dataset: xarray.Dataset, file: Union[str, os.PathLike[str]]) -> None:
    """Writes a Dataset of sweep() or open_map() as `tiltrim sweep -o map.nc` does: the same
    variables and attributes (docs/sweep.md), bit for bit; a complete file or none.

    `tiltrim diff` and `tiltrim report --sweep` read it. Raises InvalidArgument for a part of a map.
    """
    _tiltrim.save_map(_raw(dataset), os.fspath(file))


def _words(numbers: Any, words: Sequence[str], otherwise: str) -> Any:
    return np.array([*words, otherwise])[np.asarray(numbers, dtype=int)]  # -1 selects the last


def _otherwise(name: str) -> str:
    return "not_reached" if name == "status" else ""


# ---- From the library ----------------------------------------------------------------------------


def to_dataset(
    xr: Any, raw: Dict[str, Any], single: bool = False, raised: Optional[BaseException] = None
) -> xarray.Dataset:
    """A map as a Dataset; `single`: without the dimension `condition`."""
    fields: Dict[str, _Field] = raw["fields"]
    reserved = _reserved(fields)
    axes = [f"{name}_axis" if name in reserved else name for name, _ in raw["axes"]]
    names = {dim: fields[name][-1] for name, dim in _NAMES.items()}
    names.update(axis=axes, reason=fields["reason_text"][-1])
    sizes = {name: len(values) for name, values in names.items()}
    sizes.update(mode=sizes["state"], distinct_reason=sizes["reason"])
    for name in ("second_point", "crossing_condition", "interval_condition"):
        sizes[name.split("_")[0]] = len(fields[name][-1])
    sizes.update((dim, len(columns[0][5])) for dim, (_, columns) in zip(axes, raw["axes"]))
    variables = {
        name: _variable(name, field, ["condition", *axes], sizes, names)
        for name, field in fields.items()
        if name not in _NAMES
    }
    for name in ("eigenvalue", "second_eigenvalue"):
        _join(variables, name)
    coords: Dict[str, Any] = {name: (name, np.array(names[name], dtype=str)) for name in _NAMED}
    for name in [n for n in variables if n == "mode_name" or n.endswith(("_unit", "_nominal"))]:
        coords[name] = variables.pop(name)
    coords["reason_text"] = variables.pop("reason_text")
    for dim, (_, columns) in zip(axes, raw["axes"]):
        coords.update(_columns(dim, columns))
    attributes = {name: raw[name] for name in _ATTRIBUTES}
    found = xr.Dataset(variables, coords, attributes)
    _remark(found, raised)
    if raw.get("interrupted"):
        missing = int(np.count_nonzero(found.status.values == "not_reached"))
        found.attrs["interrupted"] = f"stopped with {missing} of {found.status.size} points missing"
    return found.isel(condition=0) if single else found  # type: ignore[no-any-return]


def _reserved(fields: Mapping[str, _Field]) -> Set[str]:
    """Names that no axis can have."""
    dims = {over for field in fields.values() for over in field[0]}
    return {*fields, *dims, "eigenvalue", "second_eigenvalue"}


def _variable(
    name: str, field: _Field, grid: List[str], sizes: Dict[str, int], names: Dict[str, List[str]]
) -> Tuple[List[str], Any, Dict[str, str]]:
    over, long_name, units, flags, _, scale, flat = field
    dims = [*grid, *over[1:]] if over[0] == "point" else over
    values = np.array(flat, dtype=str) if isinstance(flat, list) else flat
    if name == "second_branch":
        values = values != 0
    elif flags:
        values = _words(values, flags, _otherwise(name))
    elif name in _POSITIONS:
        values = _words(values, names[_POSITIONS[name]], "")
    elif scale:
        values = values / round(1 / scale)
    attributes = {"long_name": long_name, **({"units": units} if units else {})}
    return dims, values.reshape([sizes[dim] for dim in dims]), attributes


def _join(variables: Dict[str, Any], name: str) -> None:
    dims, real, attributes = variables.pop(f"{name}_re")
    joined = real.astype(complex)
    joined.imag = variables.pop(f"{name}_im")[1]
    variables[name] = (dims, joined, {**attributes, "long_name": "eigenvalue"})


def _columns(dim: str, columns: Sequence[Tuple[Any, ...]]) -> Dict[str, Any]:
    """The coordinates of an axis, linked by their attributes as in the file."""
    coords: Dict[str, Any] = {}
    own = [dim, *(column[0] for column in columns[1:])]
    for i, (_, key, unit, units, signal, values, si_name, si) in enumerate(columns):
        about = {"long_name": key, "units": units, "study_key": key, "study_unit": unit}
        about["signal"] = signal
        if i + 1 < len(own):
            about["next"] = own[i + 1]
        if si_name:
            about["si"] = si_name
            coords[si_name] = (dim, si, {"long_name": f"{key} in SI units"})
        coords[own[i]] = (dim, values, about)
    return coords


def _remark(found: Any, raised: Optional[BaseException]) -> None:
    threw = np.flatnonzero(found.status.values.ravel() == "model_threw")
    if len(threw):
        first = found.reason.values.ravel()[threw[0]]
        found.attrs["model_threw"] = f"at {len(threw)} of {found.status.size} points; first: {first}"
    if raised is not None:
        lines = traceback.format_exception(type(raised), raised, raised.__traceback__)
        found.attrs["exception"] = "".join(lines)


# ---- To the library ------------------------------------------------------------------------------


def _refuse(why: str) -> _tiltrim.InvalidArgument:
    return _tiltrim.InvalidArgument(
        f"save(): {why}; expected a whole map, as sweep() and open_map() return it"
    )


def _raw(ds: Any) -> Dict[str, Any]:
    fields: Dict[str, _Field] = _tiltrim.map_fields()
    if "status" not in ds or "reason_text" not in ds.coords:
        raise _refuse("no map")
    grid = list(ds.status.dims)
    names: Dict[str, List[str]] = {n: np.atleast_1d(ds[n].values).tolist() for n in _NAMED}
    names["reason"] = ds.reason_text.values.tolist()
    if [dim for dim in grid if dim != "condition"] != names["axis"]:
        axes = ", ".join(names["axis"])
        raise _refuse(f"a map over {', '.join(grid)}, whose axes were {axes}")
    if len(set(names["condition"])) < len(names["condition"]):
        raise _refuse("two conditions have one name")
    numbers = {name: _numbers(ds, name, field, grid, names) for name, field in fields.items()}
    if not np.array_equal(np.flatnonzero(numbers["second_branch"]), numbers["second_point"]):
        raise _refuse("its second branches are at other points")
    reserved = _reserved(fields)
    plain = [n[:-5] if n.endswith("_axis") and n[:-5] in reserved else n for n in names["axis"]]
    return {
        "fields": {**numbers, "axis_name": plain},
        "axes": [(n, _columns_of(ds, dim)) for n, dim in zip(plain, names["axis"])],
        **{name: ds.attrs[name] for name in _ATTRIBUTES},
    }


def _numbers(
    ds: Any, name: str, field: _Field, grid: List[str], names: Dict[str, List[str]]
) -> Any:
    """The flat values of the file's variable `name`."""
    over, _, _, flags, nothing, scale, _ = field
    if name in _NAMES:
        return names[_NAMES[name]]
    own = name[:-3] if name.endswith(("eigenvalue_re", "eigenvalue_im")) else name
    dims = [*grid, *over[1:]] if over[0] == "point" else [d for d in over if d in ds[own].dims]
    values = ds[own].transpose(*dims).values.ravel()
    if values.dtype.kind == "c":
        return values.real if name.endswith("_re") else values.imag
    if name == "second_branch":
        return values
    if flags or name in _POSITIONS:
        return _indices(name, values, flags or names[_POSITIONS[name]], nothing)
    if scale:
        return np.rint(values * round(1 / scale))
    return values.tolist() if values.dtype.kind == "U" else values


def _indices(name: str, values: Any, words: Sequence[str], nothing: bool) -> Any:
    places = {word: i for i, word in enumerate(words)}
    if nothing:
        places.setdefault(_otherwise(name), -1)
    found, inverse = np.unique(values, return_inverse=True)
    for word in found:
        if word not in places:
            raise _refuse(f"{name} '{word}'")
    return np.array([places[word] for word in found], dtype=int)[inverse]


def _columns_of(ds: Any, dim: str) -> List[Tuple[Any, ...]]:
    columns: List[Tuple[Any, ...]] = []
    name = dim
    while name:
        about = ds[name].attrs
        values = ds[name].values
        si = ds[about["si"]].values if "si" in about else values
        key, unit, signal = about["study_key"], about["study_unit"], about["signal"]
        columns.append((name, key, unit, about["units"], signal, values, "", si))
        name = about.get("next", "")
    return columns
