#!/usr/bin/env bash
# Makes the Debian package of a portable build, unpacks it, and holds what comes out of it against another build:
# the paper's study to the byte. Usage: package.sh PORTABLE_BUILD PALPATE
set -euo pipefail
build="$(realpath "$1")" other="$(realpath "$2")"
scratch="$(mktemp -d)"
trap 'rm -r "$scratch"' EXIT
root="$scratch/root"
fail() { echo "package.sh: $*" >&2; exit 1; }

(umask 077 && cd "$build" && cpack -G DEB -B "$scratch/made" > "$scratch/cpack.log" 2>&1) ||
  { cat "$scratch/cpack.log" >&2; fail "cpack failed"; }
package="$(echo "$scratch"/made/palpate_*.deb)"
dpkg-deb -R "$package" "$root"
version="$("$root/usr/bin/palpate" --version)"
[ "palpate $(dpkg-deb -f "$package" Version)" = "$version" ] || fail "the package's version is not $version"
[ "$(zcat "$root/usr/share/doc/palpate/changelog.gz" | head -n 1 | sed 's/ (/ /; s/).*//')" = "$version" ] ||
  fail "runner/install/debian/changelog does not begin with $version"

# A package without a Falcon, windows or noise would install and disappoint: what was missing when it was built?
for library in libasound2 libglfw3 libpango-1.0-0 libsamplerate0 libsndfile1 libsqlite3-0 libusb-1.0-0; do
  dpkg-deb -f "$package" Depends | grep -q "\b$library\b" || fail "it does not depend on $library"
done
for file in /etc/security/limits.d/palpate.conf /usr/lib/udev/rules.d/60-palpate.rules /usr/share/man/man1/palpate-run.1.gz \
  /usr/share/bash-completion/completions/palpate /usr/share/palpate/protocols/{protocol,scene}.schema.json \
  /usr/share/palpate/protocols/ho2000.json /usr/share/doc/palpate/{copyright,README.md,runner/README.md,images/figure15.svg}; do
  [ -e "$root$file" ] || fail "it has no $file"
done
python="$root/usr/lib/python3/dist-packages"
[ "$(env -i PYTHONPATH="$python" PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -c 'import palpate; print(palpate.__version__)')" = \
  "${version#palpate }" ] || fail "import palpate does not work"
grep -qaF -- "$PWD" "$python"/palpate/_palpate.*.so && fail "the Python module names the folder of its sources"
python3 tests/readme/links.py "$root/usr/share/doc/palpate"
[ -z "$(find "$root" \( -perm /022 -o -type d ! -perm -755 -o ! -perm -444 \) -print)" ] || fail "wrong permissions"
grep -qaF -- "$PWD" "$root/usr/bin/palpate" && fail "the program names the folder of its sources"

# `cmake --install` puts the same files into the same places.
cmake --install "$build" --strip --prefix "$scratch/installed/usr" > /dev/null
diff -r --exclude=DEBIAN "$root" "$scratch/installed"

lintian --allow-root --fail-on error,warning "$package"

# The page of a protocol, by the package's program alone and without network.
unshare --net --map-root-user bash -c 'ip link set lo up && exec /usr/bin/python3 "$@"' bash \
  tests/runner/design/design_browser_test.py "$root/usr/bin/palpate" "$root/usr/share/palpate/protocols" chromium Text Views \
  > "$scratch/design.log" 2>&1 || { cat "$scratch/design.log" >&2; fail "palpate design does not work from the package"; }

# The study by both programs, and all that is concluded from it. The package's knows nothing of the sources.
study() {  # PALPATE PROTOCOLS FOLDER
  mkdir -p "$3/figures" && cd "$3"
  env -i HOME="$3" "$1" simulate "$2/ho2000.json" --db study.db --jobs 1
  env -i HOME="$3" "$1" export --db study.db --format csv --out trials.csv --codebook codebook.csv
  env -i HOME="$3" "$1" analyze --db study.db --json analysis.json --report report.html --figures figures > report.txt
  rm study.db*
} 2> /dev/null
protocols="$(realpath protocols)"
study "$root/usr/bin/palpate" "$root/usr/share/palpate/protocols" "$scratch/package" &
studying=$!
(study "$other" "$protocols" "$scratch/other") || fail "the other build's study failed"
wait "$studying" || fail "the package's study failed"
[ "$(wc -l < "$scratch/package/trials.csv")" -eq 4257 ] || fail "the study has not 7 x 608 trials"
# Not analysis.json: the mixed model's sixteenth digits depend on the processor's instructions.
diff -rq --exclude=analysis.json "$scratch/package" "$scratch/other"
echo "package.sh: $(basename "$package") gives the same study, to the byte"
