#!/bin/sh
# Runs what depends on the processor on two that this machine need not be, in QEMU's user mode:
# Haswell, with AVX2 and fused multiply-add and no AVX-512, and Nehalem, with none of the three.
#   cmake/emulated-tests.sh <build directory> [<test program> [<doctest option>...]]
# Once for each test program; alone, a whole `tiltrim sweep`: on Haswell with the same bytes as here,
# on Nehalem, which rounds sums of products twice, with the same answers.
set -eu

build=$1
shift
root=$(cd "$(dirname "$0")/.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export TILTRIM_TRIALS="${TILTRIM_TRIALS:-0.02}"
unset TILTRIM_SIMD

# emulated <processor> <program> <argument>...; what QEMU warns of, no user's program sees.
emulated() {
  processor=$1
  shift
  echo "-- $processor: $(basename "$1") ${2:-}" >&2
  qemu-x86_64 -cpu "$processor" "$@" 2>"$scratch/errors" || { status=$?; cat "$scratch/errors" >&2; return $status; }
}

if [ $# -gt 0 ]; then
  program=$build/tests/$1
  shift
  for processor in Haswell Nehalem; do
    emulated $processor "$program" "$@" >"$scratch/said" || { cat "$scratch/said"; exit 1; }
    tail -n 3 "$scratch/said"
    if grep -q 'test cases: *0 ' "$scratch/said"; then
      echo "emulated-tests: no test case of that name" >&2
      exit 1
    fi
  done
  exit 0
fi

study=$root/studies/map_corridor.toml
"$build/bin/tiltrim" sweep "$study" -o "$scratch/native.nc" >"$scratch/said"
for processor in Haswell Nehalem; do
  emulated $processor "$build/bin/tiltrim" sweep "$study" -o "$scratch/$processor.nc" >"$scratch/said"
done
# refuses <processor> <instruction set>: or else the emulator has more than the processor, and shows nothing.
refuses() {
  ! TILTRIM_SIMD=$2 emulated "$1" "$build/bin/tiltrim" sweep "$study" >"$scratch/said" 2>&1 &&
    grep -q "TILTRIM_SIMD is '$2'" "$scratch/said" && return
  echo "emulated-tests: $1 does not refuse $2" >&2
  exit 1
}
refuses Haswell avx512
refuses Nehalem avx2
cmp "$scratch/native.nc" "$scratch/Haswell.nc"
"$build/bin/tiltrim" diff "$scratch/native.nc" "$scratch/Nehalem.nc" --format json >"$scratch/difference.json"
/usr/bin/python3 - "$scratch/difference.json" <<'END'
import json, sys
found = json.load(open(sys.argv[1]))
print("Nehalem: largest real parts differ by", found["largest_abscissa_change"], "1/s at most")
alike = not (found["changed"] or found["appeared"] or found["vanished"] or found["moved"])
sys.exit(not alike or found["largest_abscissa_change"] > 1e-12)
END
