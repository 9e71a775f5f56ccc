#!/bin/sh
# Renders scenes of pbrt-v4 by pbrt and by Lightmill, and compares the pictures.
set -eu
cd "$(dirname "$0")/../.."
. deploy/environment.sh

usage='usage: tests/bench/pbrt.sh FOLDER [OUT [SAMPLES [SCENE…]]]

Renders the .pbrt scenes of FOLDER, or these ones, with SAMPLES (256) a pixel, SIDE (128) pixels on the longer side, and as deep as they ask
for. OUT (build/bench/pbrt) gets the pictures, what both programs print, and table.md. Pictures of pbrt that are there are kept. Scenes
that Lightmill does not read are listed with their mistake. PBRT is the program of pbrt-v4 (pbrt), METHOD that of Lightmill
(path), and INTEGRATOR that of pbrt (volpath, or bdpt if the scene has it). With GREY=1,
each colour counts as its mean.'
case "${1:-}" in '' | -*) echo "$usage"; [ $# -gt 0 ] || exit 2; exit ;; esac

folder=$(cd "$1" && pwd)
out=${2:-build/bench/pbrt}
samples=${3:-256}
shift $(($# < 3 ? $# : 3))
mkdir -p "$out"

{
  echo '| scene | red | green | blue | relMSE | FLIP | what the reader changes |'
  echo '| --- | --- | --- | --- | --- | --- | --- |'
  { [ $# -gt 0 ] && printf '%s\n' "$@" || (cd "$folder" && grep -rl --include='*.pbrt' '^WorldBegin' . | sed 's|^./||' | sort); } |
    while read -r scene; do
      name=$(echo "${scene%.pbrt}" | sed 's|/pbrt/scene-v4$||; s|/|-|g')
      picture=$out/$name
      read -r copy size bounces <<TEXT
$(python3 tests/bench/peers/pbrt_copy.py "$folder/$scene" "$out/scenes/$name" --samples "$samples" --side "${SIDE:-128}" --integrator "${INTEGRATOR:-}" ${GREY:+--grey})
TEXT
      if ! build/release/bin/lightmill render "$copy" --local --method "${METHOD:-path}" --spp "$samples" --size "$size" \
        --max-bounces "$bounces" -o "$picture.exr" >"$picture.log" 2>&1; then
        echo "| $name | $(grep '^lightmill: ' "$picture.log" | tail -1 | sed "s|^lightmill: ||; s|$out/||g") | | | | | |"
      elif [ ! -e "$picture.pbrt.exr" ] && ! "${PBRT:-pbrt}" --quiet --outfile "$picture.pbrt.exr" "$copy" >"$picture.pbrt.log" 2>&1; then
        echo "| $name | pbrt: $(tail -1 "$picture.pbrt.log" | sed "s|$out/||g; s/$(printf '\033')\[[0-9;]*m//g") | | | | | |"
      else
        build/release/bin/lightmill error --json "$picture.exr" "$picture.pbrt.exr" >"$picture.json"
        python3 tests/bench/peers/error_row.py "$name" "$picture.json" "$picture.log"
      fi
    done
} >"$out/table.md"
cat "$out/table.md"
