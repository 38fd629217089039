#!/bin/sh
# Installs the Debian packages that are missing, and only those.
#   cmake/install-packages.sh program  what building the program needs
#   cmake/install-packages.sh          what building, testing and benchmarks need
#   cmake/install-packages.sh dev      and the formatter, the linter, and what some tests compare with:
#                                      MPI, Python's netCDF4 and SciPy, LAPACK; LaTeX; Doxygen, MkDocs; a
#                                      browser; another compiler; an emulator of other processors;
#                                      and what the Python package's tests need
set -eu

packages="build-essential cmake ninja-build pkg-config file
  libeigen3-dev coinor-libipopt-dev liblapack-dev libblas-dev libnlopt-dev libnlopt-cxx-dev libfmt-dev libtomlplusplus-dev
  libcli11-dev nlohmann-json3-dev libboost-dev libboost-math-dev libtbb-dev libnetcdf-dev libmatio-dev zlib1g-dev libflint-arb-dev libflint-dev
  gnuplot-nox doctest-dev"
[ "${1:-}" = program ] || packages="$packages libbenchmark-dev pybind11-dev python3-dev python3-numpy"
[ "${1:-}" != dev ] || packages="$packages clang libclang-rt-14-dev lld clang-format clang-tidy qemu-user
  libopenmpi-dev openmpi-bin python3-netcdf4 python3-scipy
  python3-pytest python3-xarray python3-matplotlib python3-joblib python3-jsonschema python3-venv mypy
  texlive-latex-recommended texlive-science doxygen mkdocs lintian zsh fish chromium chromium-driver python3-selenium"

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "install-packages: not a Debian system; make sure these are installed:" $packages >&2
  exit 0
fi

missing=""
for package in $packages; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) || true
  [ "$status" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

as_root=""
[ "$(id -u)" -eq 0 ] || as_root=sudo
echo "install-packages: installing$missing"
if ! { $as_root apt-get update -q &&
       $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends $missing; }
then
  echo "install-packages: apt-get failed (no network, or no right to install?). Missing:$missing" >&2
  exit 1
fi
