#!/bin/sh
# Checks that clang-format would change no source file. layout.sh SOURCE-FOLDER
set -eu
cd "$1"
git ls-files -z '*.cpp' '*.h' | xargs -0 clang-format --dry-run -Werror
