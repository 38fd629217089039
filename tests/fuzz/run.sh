#!/usr/bin/env bash
# run.sh <folder of the programs> <seconds> [jobs]: runs every fuzz target for so many seconds, prints how many inputs
# each has taken, and fails if one was not refused as documented. What was found stays in the folder's findings/.
set -euo pipefail
programs=$(realpath "$1")
export programs seconds=$2
source=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../..")
scratch=$(mktemp -d -p /dev/shm 2>/dev/null || mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export source scratch TILTRIM_DATA=$source/data

one_target() {
  local name=$1 seeds=()
  mkdir -p "$scratch/$name" "$programs/corpus/$name" "$programs/findings"
  [ ! -d "$source/tests/fuzz/$name" ] || seeds+=("$source/tests/fuzz/$name")
  case $name in
    study) seeds+=("$source/studies") ;;
    polar) seeds+=("$source/data") ;;
  esac
  local options=(-max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -print_final_stats=1)
  [ ! -f "$source/tests/fuzz/$name.dict" ] || options+=(-dict="$source/tests/fuzz/$name.dict")
  cd "$scratch/$name"
  "$programs/fuzz_$name" "${options[@]}" -artifact_prefix="$scratch/$name/" "$programs/corpus/$name" "${seeds[@]}" \
    > "$scratch/$name.log" 2>&1 && return
  touch "$scratch/$name.failed"
  find . -size +0 \( -name 'crash-*' -o -name 'timeout-*' -o -name 'oom-*' -o -name 'leak-*' \) \
    -exec cp {} "$programs/findings/" \;
}
export -f one_target

names=$(cd "$programs" && printf '%s\n' fuzz_* | sed 's/^fuzz_//')
xargs -P "${3:-$(nproc)}" -I{} bash -c 'one_target {}' <<< "$names"
total=0
failed=0
for name in $names; do
  log=$scratch/$name.log
  if [ -f "$scratch/$name.failed" ]; then
    failed=1
    grep -vE '^#[0-9]|NEW_FUNC|^INFO' "$log" | tail -n 60
    echo "$name: FAILED; the input is in $programs/findings"
  fi
  count=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  rate=$(sed -n 's/^stat::average_exec_per_sec: *//p' "$log")
  printf '%-9s %10d inputs, %7d per second\n' "$name" "${count:-0}" "${rate:-0}"
  total=$((total + ${count:-0}))
done
printf '%-9s %10d inputs\n' all "$total"
exit $failed
