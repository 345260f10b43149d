#!/usr/bin/env bash
# Builds palpate and runs its tests. Ends with ctest's closing lines.
# Usage: tests/run.sh        what a change must pass
#        tests/run.sh all    also the tests of windows and of long studies
set -euo pipefail
cd "$(dirname "$0")/.."
runner/install_packages.sh tests
cmake --preset release -DPALPATE_TESTS=ON > /dev/null
cmake --build --preset release
apart='clock|windows|long'
if [ "${1:-}" = all ]; then
  apart='clock|windows'
  ctest --preset release -L '^windows$' --repeat until-pass:2
fi
ctest --preset release -j "$(nproc)" -LE "^($apart)\$"
# Tests that wait for the machine's clock (a guard process that must act within 20 ms, live sessions) run alone
# and last, and may try twice: a shared machine that stood still shows nothing.
ctest --preset release -L '^clock$' --repeat until-pass:2
