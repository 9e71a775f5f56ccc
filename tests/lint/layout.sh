#!/bin/sh
# Checks that clang-format would change no source file. layout.sh SOURCE-FOLDER
set -eu
cd "$1"
files=$(mktemp)
trap 'rm -f "$files"' EXIT
# Without those that are deleted, and not yet so in the index.
git ls-files -z --cached --others --exclude-standard '*.cpp' '*.h' | xargs -0 sh -c 'for file; do [ ! -e "$file" ] || printf "%s\0" "$file"; done' sh >"$files"
[ -s "$files" ]
xargs -0 clang-format --dry-run -Werror <"$files"
