#!/bin/sh
# Renders one scene with Blender's Cycles, and with Lightmill through Blender's glTF export, and prints the difference. Needs
# Blender. The pictures stay in FOLDER (default build/bench/blender).
#
#   tests/bench/blender/run.sh [FOLDER [SAMPLES]]
set -eu
cd "$(dirname "$0")/../../.."
. deploy/environment.sh

usage='usage: tests/bench/blender/run.sh [FOLDER [SAMPLES]]

Renders one scene by Cycles and by Lightmill, with SAMPLES (512) a pixel, and prints how far the pictures, which stay in FOLDER
(build/bench/blender), are from each other. Needs Blender: the one that LIGHTMILL_BLENDER names, or blender.'
case "${1:-}" in -h | --help) echo "$usage"; exit ;; -*) echo "$usage" >&2; exit 2 ;; esac

folder=${1:-build/bench/blender}
samples=${2:-512}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
lightmill=build/release/bin/lightmill

echo "Cycles, $samples samples per pixel"
"${LIGHTMILL_BLENDER:-blender}" --background --factory-startup --python-exit-code 3 \
  --python tests/bench/blender/make_scene.py -- "$folder/scene.blend" "$folder/cycles.exr" "$samples" >"$folder/cycles.log" 2>&1 ||
  { tail "$folder/cycles.log"; exit 1; }
echo "Lightmill, $samples samples per pixel"
"$lightmill" render "$folder/scene.blend" --local --spp "$samples" -o "$folder/lightmill.exr" -o "$folder/lightmill.png"
"$lightmill" error "$folder/lightmill.exr" "$folder/cycles.exr"
