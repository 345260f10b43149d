#!/bin/sh
# Schedules and levels must not depend on compiler or optimisation: builds a program that prints them
# with both compilers at opposite ends, or one at both, and compares what they print, byte for byte.
# Usage: compilers.sh SOURCE_DIR FILE.cpp ...
set -eu

source=$1
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fast="-O3 -march=native"
if ! command -v clang++ >/dev/null; then
  set -- "g++ -O0" "g++ $fast" -- "$@"
elif ! command -v g++ >/dev/null; then
  set -- "clang++ -O0" "clang++ $fast" -- "$@"
else
  set -- "clang++ -O0" "g++ $fast" -- "$@"
fi
first=$1 second=$2
shift 3
print_with() {  # COMMAND OUTPUT FILE.cpp ...
  command=$1 output=$2
  shift 2
  # shellcheck disable=SC2086  # a compiler and its options
  $command -std=c++20 -ffp-contract=off -DGLM_FORCE_CTOR_INIT -I"$source" "$@" -o "$output.out"
  "$output.out" >"$output"
  lines=$(wc -l <"$output")
  [ "$lines" -ge 1000 ] || { echo "$command: only $lines lines were printed"; exit 1; }
}
print_with "$first" "$work/first" "$@"
print_with "$second" "$work/second" "$@"
cmp "$work/first" "$work/second" || { echo "$first and $second: not the same"; exit 1; }
echo "$first and $second: $lines lines, the same"
