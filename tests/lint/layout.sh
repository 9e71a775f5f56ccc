#!/bin/sh
# Checks that clang-format would change no source file. layout.sh SOURCE-FOLDER
set -eu
cd "$1"
files=$(mktemp)
trap 'rm -f "$files"' EXIT
git ls-files -z --cached --others --exclude-standard '*.cpp' '*.h' >"$files"
[ -s "$files" ]
xargs -0 clang-format --dry-run -Werror <"$files"
