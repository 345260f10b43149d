#!/usr/bin/env bash
# Runs each fuzz target under AddressSanitizer and UndefinedBehaviorSanitizer from the kept corpus on.
# Usage: tests/fuzz/run.sh [SECONDS_EACH [TARGET ...]]; inputs that fail are left in .build/fuzz/found.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds="${1:-10}"
shift || true
targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=(protocol scene unions surface csv obj stl ply off 3mf packets samples database settings printable trajectory
  gltf msh pattern sweep_space advisor haply serve_messages study_files)

cmake --preset asan > /dev/null
cmake --build --preset asan --target "${targets[@]/#/fuzz_}"
[ ! -w /dev/shm ] || export TMPDIR=/dev/shm  # targets that read files write them first
found="$PWD/.build/fuzz/found"
mkdir -p "$found"
run() {
  local target="$1" corpora=("tests/fuzz/corpus/$1")
  [ "$target" != protocol ] || corpora+=(tests/protocols/good tests/protocols/bad)
  mkdir -p ".build/fuzz/corpus/$target"
  ".build/asan/tests/fuzz/fuzz_$target" ".build/fuzz/corpus/$target" "${corpora[@]}" -max_total_time="$seconds" \
    -max_len=4096 -timeout=20 -rss_limit_mb=2048 -print_final_stats=1 -artifact_prefix="$found/$target-" \
    > ".build/fuzz/$target.log" 2>&1 ||
    { tail -n 40 ".build/fuzz/$target.log"; echo "fuzz $target: an input fails, see $found" >&2; return 1; }
  echo "$target: $(grep -E 'number_of_executed_units' ".build/fuzz/$target.log" | tr -s ' ' | cut -d' ' -f2) inputs, none fails"
}
export -f run
export seconds found
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -c 'run {}'
