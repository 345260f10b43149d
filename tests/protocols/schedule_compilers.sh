#!/bin/sh
# Schedules must not depend on compiler or optimisation: builds print_schedule.cpp with every
# compiler that is there and compares what it prints, byte for byte.
# Usage: schedule_compilers.sh SOURCE_DIR
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
      "$source"/tests/protocols/print_schedule.cpp \
      "$source"/protocols/latin_square.cpp "$source"/protocols/order.cpp \
      "$source"/protocols/protocol.cpp "$source"/protocols/schedule.cpp \
      "$source"/stimuli/orientation.cpp "$source"/stimuli/random.cpp -o "$work/print"
    "$work/print" >"$work/now"
    [ -s "$work/now" ] || { echo "$compiler $options: nothing was printed"; exit 1; }
    [ $built -gt 0 ] || cp "$work/now" "$work/first"
    cmp "$work/first" "$work/now" || { echo "$compiler $options: another schedule"; exit 1; }
    built=$((built + 1))
    echo "$compiler $options: $(wc -l <"$work/now") trials, the same"
  done
done
[ $built -ge 2 ] || { echo "no two builds to compare: g++ or clang++ is needed"; exit 1; }
