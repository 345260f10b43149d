#!/usr/bin/env bash
# Builds palpate and runs all its tests. Ends with ctest's closing lines.
set -euo pipefail
cd "$(dirname "$0")/.."
runner/install_packages.sh tests
cmake --preset release -DPALPATE_TESTS=ON > /dev/null
cmake --build --preset release
ctest --preset release -j "$(nproc)"
