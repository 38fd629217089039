"""Packages that are needed by one function alone, imported where it is called."""

from __future__ import annotations

import importlib
from typing import Any


def need(module: str, package: str, what: str) -> Any:
    """The module, or an ImportError that names the package that has it and what needs it."""
    try:
        return importlib.import_module(module)
    except ImportError as missing:
        raise ImportError(
            f"{what} needs the package '{package}', which cannot be imported here: {missing}"
        ) from missing
