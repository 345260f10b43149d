#!/usr/bin/env bash
# Makes palpate(1) and a page for each command of what --help says. Usage: man_pages.sh PALPATE VERSION FOLDER
set -euo pipefail
umask 022
program=$1 version=$2 folder=$3
command -v help2man > /dev/null || { echo "no help2man, which makes the man pages: apt-get install help2man" >&2; exit 1; }
scratch="$(mktemp -d)"
trap 'rm -r "$scratch"' EXIT
mkdir -p "$folder"

# Help as help2man reads it: a usage on one line, further ones after "or:", and every description under its option.
readable() {
  awk '{ line[NR] = $0; if ($1 == "-h") column = index($0, "show this help") }
       END {
         for (i = 1; i <= NR; ++i) {
           if (line[i] ~ /^Usage: /) usage = 1
           if (line[i] == "") usage = 0
           if (column && line[i] ~ /^  -/ && substr(line[i], column - 1, 1) == " ")
             line[i] = sprintf("%s\n%*s%s", substr(line[i], 1, column - 1), column - 1, "", substr(line[i], column))
           if (usage && line[i] ~ /^ +palpate /) sub(/^ +/, "\n  or:  ", line[i])
           else if (usage && line[i] ~ /^ /) sub(/^ +/, " ", line[i])
           else if (i > 1) printf "\n"
           printf "%s", line[i]
         }
         printf "\n"
       }'
}

page() {  # NAME SUMMARY INCLUDE, of the help on standard input
  cat > "$scratch/help"
  { cat "$3"
    if grep -q '^Examples:$' "$scratch/help"; then
      printf '\n[examples]\n.nf\n'
      sed '1,/^Examples:$/d; /^$/d; s/\\/\\e/g; s/-/\\-/g; s/^/\\\&/' "$scratch/help"
      printf '.fi\n'
    fi
  } > "$scratch/include"
  sed '/^Examples:$/,$d' "$scratch/help" | readable > "$scratch/text"
  printf '#!/bin/sh\ncat %q\n' "$scratch/text" > "$scratch/$1"
  chmod +x "$scratch/$1"
  help2man --no-info --version-string="$version" --name="$2" --include="$scratch/include" "$scratch/$1" > "$scratch/$1.1"
  gzip -9n < "$scratch/$1.1" > "$folder/$1.1.gz"
}

commands="$("$program" --help | sed -n 's/^  \([a-z]\+\)  .*/\1/p')"
pages=""
for name in $commands; do
  pages+="${pages:+, }.BR palpate-$name (1)"
done
cat > "$scratch/all.h2m" << END
[files]
.TP
.I /usr/share/palpate/protocols
protocols to start from, with their JSON schemas
.TP
.I /usr/share/doc/palpate
what a session consists of, devices, formats of data, the evidence
.TP
.I /etc/security/limits.d/palpate.conf
real-time priority and locked memory for members of the group palpate

[see also]
${pages//, /,$'\n'}
END
printf '[see also]\n.BR palpate (1)\n' > "$scratch/one.h2m"

"$program" --help | tail -n +3 | page palpate "psychophysics experiment runner for touch" "$scratch/all.h2m"
for name in $commands; do
  summary="$("$program" --help | sed -n "s/^  $name  *//p")"
  "$program" "$name" --help | page "palpate-$name" "$summary" "$scratch/one.h2m"
done
