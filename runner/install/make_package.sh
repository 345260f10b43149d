#!/usr/bin/env bash
# Builds palpate for any processor of this machine's kind and makes a Debian package of it in the working directory.
set -euo pipefail
here="$(cd "$(dirname "$0")/../.." && pwd)"
out="$PWD"
"$here/runner/install_packages.sh" package
cd "$here"
echo "Building (a few minutes the first time) ..." >&2
scratch="$(mktemp -d)"
trap 'rm -r "$scratch"' EXIT
cmake --preset portable -DPALPATE_TESTS=OFF -DPALPATE_PYTHON=ON > /dev/null
cmake --build --preset portable --target palpate palpate_python > .build/portable/build.log 2>&1 ||
  { tail -n 30 .build/portable/build.log >&2; echo "The build failed; all of its output: $here/.build/portable/build.log" >&2; exit 1; }
cpack --preset portable -B "$scratch" > .build/portable/cpack.log 2>&1 ||
  { cat .build/portable/cpack.log >&2; exit 1; }
mv "$scratch"/palpate_*.deb "$out"
echo "Made $(ls "$out"/palpate_*.deb). Install it: sudo apt install ./palpate_*.deb" >&2
