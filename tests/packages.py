"""What a script of the tests does where a package that it needs is missing."""

import importlib
import os
import sys

SKIPPED = 77


def leave_out(missing):
    """Says that a check is left out; where TILTRIM_NO_SKIP is set, the script fails."""
    if os.environ.get("TILTRIM_NO_SKIP"):
        print(f"{missing} is not installed, and TILTRIM_NO_SKIP is set")
        sys.exit(1)
    print(f"skipped: {missing} is not installed")


def skip(missing):
    """Leaves out everything: called before anything is checked."""
    leave_out(missing)
    sys.exit(SKIPPED)


def need(package, *modules):
    """The modules, imported; `package` is what Debian calls the one that has them."""
    try:
        return [importlib.import_module(module) for module in modules]
    except ModuleNotFoundError as error:
        # One of the modules asked for, or a package around it: not what these themselves import.
        if not any(f"{module}.".startswith(f"{error.name}.") for module in modules):
            raise
        skip(package)
