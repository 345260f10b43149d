#!/usr/bin/env bash
# Installs what is made on the way: man pages, the compressed changelog, READMEs, and the limits, which stand in /etc
# where the rest goes to /usr. Usage: made_files.sh PALPATE VERSION PREFIX
set -euo pipefail
umask 022
program=$1 version=$2 prefix=$3
here="$(cd "$(dirname "$0")" && pwd)"

install -D -m 644 "$here/limits.conf" "${prefix%/usr}/etc/security/limits.d/palpate.conf"
mkdir -p "$prefix/share/doc/palpate"
gzip -9n < "$here/debian/changelog" > "$prefix/share/doc/palpate/changelog.gz"
# The changelog's date is the man pages' too: the same sources give the same files.
SOURCE_DATE_EPOCH="$(date -d "$(sed -n 's/^ -- .*>  //p' "$here/debian/changelog" | head -n 1)" +%s)"
export SOURCE_DATE_EPOCH
bash "$here/man_pages.sh" "$program" "$version" "$prefix/share/man/man1"
bash "$here/documentation.sh" "$prefix"
