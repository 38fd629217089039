"""Optional packages, each imported in the function that needs it."""

from __future__ import annotations

import importlib
from typing import Any


def need(module: str, package: str, what: str) -> Any:
    """The module, or an ImportError naming the missing package and what needs it."""
    try:
        return importlib.import_module(module)
    except ImportError as missing:
        raise ImportError(
            f"{what} needs the package '{package}', which cannot be imported here: {missing}"
        ) from missing
