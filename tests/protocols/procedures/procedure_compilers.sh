#!/bin/sh
# Levels must not depend on compiler or optimisation: builds print_procedures.cpp with every compiler
# that is there and compares what it prints, byte for byte.
# Usage: procedure_compilers.sh SOURCE_DIR
set -eu

source=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
built=0
for compiler in g++ clang++; do
  command -v "$compiler" >/dev/null || continue
  for options in "-O0" "-O3 -march=native"; do
    # shellcheck disable=SC2086  # several options
    "$compiler" -std=c++20 $options -ffp-contract=off -DGLM_FORCE_CTOR_INIT -I"$source" \
      "$source"/tests/protocols/procedures/print_procedures.cpp "$source"/protocols/procedures/*.cpp \
      "$source"/stimuli/random.cpp -o "$work/print"
    "$work/print" >"$work/now"
    [ "$(wc -l <"$work/now")" -gt 1000 ] || { echo "$compiler $options: too little was printed"; exit 1; }
    [ $built -gt 0 ] || cp "$work/now" "$work/first"
    cmp "$work/first" "$work/now" || { echo "$compiler $options: other levels"; exit 1; }
    built=$((built + 1))
    echo "$compiler $options: $(wc -l <"$work/now") lines, the same"
  done
done
[ $built -ge 2 ] || { echo "no two builds to compare: g++ or clang++ is needed"; exit 1; }
