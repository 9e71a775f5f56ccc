#!/bin/sh
# Renders small Blender scenes with one feature each by Cycles and by Lightmill, and compares them. Needs Blender with numpy.
#
#   tests/bench/fidelity/run.sh [FOLDER [SAMPLES [CASE…]]]
set -eu
cd "$(dirname "$0")/../../.."
. deploy/environment.sh

usage='usage: tests/bench/fidelity/run.sh [FOLDER [SAMPLES [CASE…]]]

Renders the cases of tests/bench/fidelity/cases.py, or these, by Cycles and by Lightmill, with SAMPLES (512) a pixel.
FOLDER (build/bench/fidelity) gets table.md and index.html. Pictures that are there are kept. Needs Blender: the one that
LIGHTMILL_BLENDER names, or blender. deploy/setup --blender
installs it.'
case "${1:-}" in -h | --help) echo "$usage"; exit ;; -*) echo "$usage" >&2; exit 2 ;; esac

folder=${1:-build/bench/fidelity}
samples=${2:-512}
[ $# -lt 2 ] || shift
[ $# -lt 1 ] || shift
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
in_blender() {
  "${LIGHTMILL_BLENDER:-blender}" --background --factory-startup --python-exit-code 3 --python "$@" >"$folder/log" 2>&1 ||
    { tail "$folder/log"; exit 1; }
}

in_blender tests/bench/fidelity/cases.py -- "$folder" "$samples" "$@"
for scene in "$folder"/*.blend; do
  name=${scene%.blend}
  [ -e "$name.lightmill.exr" ] || build/release/bin/lightmill render "$scene" --local --method path --spp "$samples" \
    -o "$name.lightmill.exr" 2>"$name.notices"
  build/release/bin/lightmill error --json "$name.lightmill.exr" "$name.cycles.exr" >"$name.json"
done
in_blender tests/bench/fidelity/page.py -- "$folder"
cat "$folder/table.md"
