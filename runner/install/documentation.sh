#!/usr/bin/env bash
# Installs the READMEs with their folders and pictures, so that their links to each other hold.
# Usage: documentation.sh PREFIX
set -euo pipefail
umask 022
here="$(cd "$(dirname "$0")" && pwd)"
sources="$(cd "$here/../.." && pwd)"
to="$1/share/doc/palpate"

for page in README.md {analysis,data,protocols,rendering,runner,runner/participants,runner/python,stimuli,tests}/README.md; do
  mkdir -p "$(dirname "$to/$page")"
  # Not into a folder that nobody sees.
  sed 's#\.github/images/#images/#g' "$sources/$page" > "$to/$page"
  chmod 644 "$to/$page"
done
install -D -m 644 -t "$to/images" "$sources"/.github/images/*
