#!/bin/sh
# Schedules and levels must not depend on compiler or optimisation: builds a program that prints them
# with every compiler that is there and compares what it prints, byte for byte.
# Usage: compilers.sh SOURCE_DIR FILE.cpp ...
set -eu

source=$1
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
built=0
for compiler in g++ clang++; do
  command -v "$compiler" >/dev/null || continue
  for options in "-O0" "-O3 -march=native"; do
    # shellcheck disable=SC2086  # several options
    "$compiler" -std=c++20 $options -ffp-contract=off -DGLM_FORCE_CTOR_INIT -I"$source" "$@" -o "$work/print"
    "$work/print" >"$work/now"
    lines=$(wc -l <"$work/now")
    [ "$lines" -ge 1000 ] || { echo "$compiler $options: only $lines lines were printed"; exit 1; }
    [ $built -gt 0 ] || cp "$work/now" "$work/first"
    cmp "$work/first" "$work/now" || { echo "$compiler $options: not the same"; exit 1; }
    built=$((built + 1))
    echo "$compiler $options: $lines lines, the same"
  done
done
[ $built -ge 2 ] || { echo "no two builds to compare: g++ or clang++ is needed"; exit 1; }
