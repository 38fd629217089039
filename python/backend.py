"""The build backend of `pip install .` (PEP 517): CMake builds, this writes the wheel.

With the environment variable TILTRIM_BUILD=<folder> an existing build folder is used as configured
(-D TILTRIM_PYTHON=ON for this Python); else one is made under build/, for this Python.
"""

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SUFFIX = sysconfig.get_config_var("EXT_SUFFIX")
VERSION = re.search(r"project\(tiltrim VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
INFO = f"tiltrim-{VERSION}.dist-info"
TAG = "cp{0}{1}-cp{0}{1}-{2}".format(
    *sys.version_info[:2], re.sub(r"[-.]", "_", sysconfig.get_platform())
)
METADATA = f"""Metadata-Version: 2.1
Name: tiltrim
Version: {VERSION}
Summary: Trim and linear-stability toolkit for flight dynamics
License: MIT
Requires-Python: >=3.9
Requires-Dist: numpy
Provides-Extra: all
Requires-Dist: scipy; extra == "all"
Requires-Dist: xarray; extra == "all"
Requires-Dist: control; extra == "all"
"""
WHEEL = f"Wheel-Version: 1.0\nGenerator: tiltrim\nRoot-Is-Purelib: false\nTag: {TAG}\n"


def run(*command, failed):
    """Runs a program with its output on the terminal; exits with `failed` if it fails."""
    try:
        subprocess.run([str(word) for word in command], cwd=ROOT, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        sys.exit(f"tiltrim: {failed} ({error})")


def configured():
    """A build folder for this Python."""
    chosen = os.environ.get("TILTRIM_BUILD")
    if chosen:
        return ROOT / chosen
    if shutil.which("cmake") is None:
        sys.exit("tiltrim: cmake is not installed; expected CMake 3.25 or newer (Debian: cmake)")
    build = ROOT / "build" / f"python-{sysconfig.get_config_var('SOABI')}"
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    run(
        "cmake", "-S", ROOT, "-B", build, *generator, "-D", "CMAKE_BUILD_TYPE=Release",
        "-D", "TILTRIM_PYTHON=ON", "-D", "TILTRIM_TESTS=OFF", "-D", "TILTRIM_UNITY=ON",
        "-D", f"Python_EXECUTABLE={sys.executable}",
        failed="configuring failed: a library is missing, or Python's headers (see above); "
        "cmake/install-packages.sh has the names of all of them in Debian",
    )  # fmt: skip
    return build


def staged(folder):
    """The importable package, built and installed into `folder`."""
    build = configured()
    run(
        "cmake", "--build", build, "--target", "tiltrim_python", "--parallel", os.cpu_count() or 2,
        failed=f"building in {build} failed: see above; expected a folder configured with "
        "-D TILTRIM_PYTHON=ON",
    )  # fmt: skip
    run("cmake", "--install", build, "--component", "python", "--prefix", folder, "--strip",
        failed=f"installing from {build} failed: see above")  # fmt: skip
    if not (folder / "tiltrim" / f"_tiltrim{SUFFIX}").exists():
        sys.exit(f"tiltrim: {build} was not configured for this Python, {sys.executable}")


def record(name, content):
    """A file's line of RECORD."""
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """PEP 517: metadata that pip requests before building."""
    info = Path(metadata_directory) / INFO
    info.mkdir()
    (info / "METADATA").write_text(METADATA)
    (info / "WHEEL").write_text(WHEEL)
    return INFO


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """PEP 517: writes the wheel, returns its name."""
    with tempfile.TemporaryDirectory() as folder:
        staged(Path(folder))
        files = {
            str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(Path(folder).rglob("*"))
            if path.is_file()
        }
    files[f"{INFO}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    files[f"{INFO}/METADATA"] = METADATA.encode()
    files[f"{INFO}/WHEEL"] = WHEEL.encode()
    lines = [record(name, content) for name, content in files.items()]
    files[f"{INFO}/RECORD"] = ("".join(lines) + f"{INFO}/RECORD,,\n").encode()
    name = f"tiltrim-{VERSION}-{TAG}.whl"
    with zipfile.ZipFile(Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in files.items():
            wheel.writestr(path, content)
    return name


def build_sdist(sdist_directory, config_settings=None):
    """Required by PEP 517; the repository is the source."""
    sys.exit("tiltrim: there is no source distribution; expected a wheel, or pip install <folder>")
