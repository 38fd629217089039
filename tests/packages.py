"""What a test script does if a package it needs is missing."""

import importlib
import os
import sys

SKIPPED = 77


def leave_out(missing):
    """Reports a skipped check; if TILTRIM_NO_SKIP is set, the script fails."""
    if os.environ.get("TILTRIM_NO_SKIP"):
        print(f"{missing} is not installed, and TILTRIM_NO_SKIP is set")
        sys.exit(1)
    print(f"skipped: {missing} is not installed")


def skip(missing):
    """Skips the whole script: called before any check."""
    leave_out(missing)
    sys.exit(SKIPPED)


def need(package, *modules):
    """The modules, imported; `package` is the Debian package that has them."""
    try:
        return [importlib.import_module(module) for module in modules]
    except ModuleNotFoundError as error:
        # One of these modules or their parent package, not one of their own imports.
        if not any(f"{module}.".startswith(f"{error.name}.") for module in modules):
            raise
        skip(package)
