#!/usr/bin/env python3
"""Reads a map with the netCDF4 package and compares values: read_map.py FILE NAME[i,j,...]=VALUE ...

NAME is a variable, or NAME@ATTRIBUTE without an index. VALUE is a number, compared exactly, a text,
or -- for a masked value. Exit code 0: all as expected; 1: not; 77: no netCDF4 package (skipped).
If xarray is installed it must also open the file and find the same shapes.
"""

import importlib.util
import re
import sys

sys.dont_write_bytecode = True
from packages import leave_out, need  # noqa: E402

netCDF4, numpy = need("python3-netcdf4", "netCDF4", "numpy")


def found(data, name, index):
    if "@" in name:
        variable, attribute = name.split("@")
        return (data[variable] if variable else data).getncattr(attribute)
    value = data[name][tuple(index)]
    if numpy.ma.is_masked(value):
        return "--"
    return value.item() if hasattr(value, "item") else value


def same(value, expected):
    if isinstance(value, str):
        return value == expected
    return float(value) == float(expected)


def misses(data, expectations):
    for expectation in expectations:
        name, index, expected = re.fullmatch(r"([^\[=]+)(?:\[([\d,]*)\])?=(.*)", expectation).groups()
        value = found(data, name, [int(i) for i in (index or "").split(",") if i])
        if not same(value, expected):
            yield f"{name}[{index}] is {value!r}, expected {expected}"


def check_xarray(data, path):
    if not importlib.util.find_spec("xarray"):
        return leave_out("python3-xarray")
    import xarray

    with xarray.open_dataset(path) as opened:
        for name in ("eigenvalue_re", "confidence", "status", "state_value"):
            assert opened[name].shape == data[name].shape, name
        assert opened.confidence.max() <= 1.0
        assert str(opened.condition_name.values[0]) == data["condition_name"][0]


def main():
    path, expectations = sys.argv[1], sys.argv[2:]
    with netCDF4.Dataset(path) as data:
        missed = list(misses(data, expectations))
        check_xarray(data, path)
    print("\n".join(missed) or f"{len(expectations)} values as expected")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
