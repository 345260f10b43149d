#!/usr/bin/env bash
# Builds palpate, re-runs the paper's study with simulated participants, and shows what came out.
# Usage: quickstart.sh [FOLDER]    (default: results/ho2000-simulated beside the sources)
set -euo pipefail
here="$(cd "$(dirname "$0")/.." && pwd)"
out="${1:-$here/results/ho2000-simulated}"
mkdir -p "$out"
out="$(cd "$out" && pwd)"

# The Python module too, where the build found Python's headers.
targets() {
  echo palpate
  grep -q '^PALPATE_PYTHON:BOOL=ON' .build/release/CMakeCache.txt && echo palpate_python
}

"$here/runner/install_packages.sh" build
cd "$here"
echo "Building (a few minutes the first time) ..." >&2
cmake --preset release -DPALPATE_TESTS=OFF > "$out/build.log" 2>&1 &&
  cmake --build --preset release --target $(targets) >> "$out/build.log" 2>&1 ||
  { tail -n 30 "$out/build.log" >&2; echo "The build failed; all of its output: $out/build.log" >&2; exit 1; }
palpate=.build/release/runner/palpate

echo "Simulating 7 participants x 2 renderers x 304 trials into $out ..." >&2
"$palpate" simulate protocols/ho2000.json --db "$out/study.db" --participants 7
"$palpate" export --db "$out/study.db" --format csv --out "$out/trials.csv" \
  --codebook "$out/codebook.csv" --force
"$palpate" analyze --db "$out/study.db" --json "$out/analysis.json" --report "$out/report.html" \
  --figures "$out" --force > "$out/report.txt"
echo
sed '/^Response times/,$d' "$out/report.txt"
cat << END
Database      $out/study.db
Trials        $out/trials.csv (what its columns mean: codebook.csv)
Report        $out/report.html (the same as text: report.txt; as numbers: analysis.json)
Figure 15     $out/figure15.svg (and the other figures beside it)
END
if [ "$(targets)" != palpate ]; then
  echo "Python        PYTHONPATH=$here/.build/release/runner/python python3 -c 'import palpate; help(palpate)'"
fi
