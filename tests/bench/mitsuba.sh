#!/bin/sh
# Renders the test scenes of Mitsuba's data repository, and compares them with the reference pictures there.
set -eu
cd "$(dirname "$0")/../.."
. deploy/environment.sh

usage='usage: tests/bench/mitsuba.sh DATA [FOLDER [SAMPLES]]

DATA is a checkout of https://github.com/mitsuba-renderer/mitsuba-data. Its scenes in tests/scenes are rendered with SAMPLES
(256) a pixel. FOLDER (build/bench/mitsuba) gets the pictures, what the renders print, and table.md. Scenes that Lightmill does not read
are listed with their mistake.'
case "${1:-}" in '' | -*) echo "$usage"; [ $# -gt 0 ] || exit 2; exit ;; esac

data=$(cd "$1" && pwd)/tests/scenes
folder=${2:-build/bench/mitsuba}
samples=${3:-256}
mkdir -p "$folder"

# The references have a largest depth of light paths. A depth of 2 is one bounce, as of the integrator direct.
bounces_of() {
  depth=$(build/release/bin/lightmill check "$1" 2>&1 | sed -n 's/.*max_depth \([0-9]*\) of the integrator.*/\1/p')
  echo $((${depth:-2} - 1))
}

{
  echo '| scene | red | green | blue | relMSE | FLIP |'
  echo '| --- | --- | --- | --- | --- | --- |'
  for reference in "$data"/*/refs/*_ref_rgb.exr; do
    kind=$(basename "$(dirname "$(dirname "$reference")")")
    name=$(basename "$reference" _ref_rgb.exr)
    scene=$(find "$data/$kind" -regex ".*/${name}_[a-z]*\.xml")
    picture=$folder/$kind-$name
    if build/release/bin/lightmill render "$scene" --local --method path --spp "$samples" \
      --max-bounces "$(bounces_of "$scene")" -o "$picture.exr" >"$picture.log" 2>&1; then
      build/release/bin/lightmill error --json "$picture.exr" "$reference" >"$picture.json"
      python3 tests/bench/peers/error_row.py "$kind/$name" "$picture.json"
    else
      echo "| $kind/$name | $(tail -1 "$picture.log" | sed "s|.*/||") | | | | |"
    fi
  done
} >"$folder/table.md"
cat "$folder/table.md"
