#!/bin/sh
# Reads the mattes of a Lightmill picture by name in Blender's compositor, and compares their pixels with the exact area of the
# triangle in them. Fails if they differ by more than a pixel. Needs Blender. Files stay in FOLDER (default build/bench/blender).
#
#   tests/bench/blender/mattes.sh [FOLDER]
set -eu
cd "$(dirname "$0")/../../.."
. deploy/environment.sh

folder=${1:-build/bench/blender}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

# At distance 1 from the camera a unit is 64 pixels.
cat >"$folder/mattes.json" <<'JSON'
{"camera": {"eye": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 90},
 "film": {"width": 128, "height": 128, "filter": {"kind": "BOX"}},
 "materials": [{"name": "paper", "diffuse": {"reflectance": {"rgb": [0.8, 0.8, 0.8]}}},
               {"name": "paint", "diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}}],
 "objects": [{"name": "wall", "material": "paint", "plane": {"point": [0, 0, -1], "normal": [0, 0, 1]}},
             {"name": "card", "material": "paper",
              "triangle": {"a": [-0.5, -0.3, 0], "b": [0.7, -0.4, 0], "c": [0.1, 0.6, 0]}}],
 "lights": [{"name": "sky", "environment": {"radiance": {"rgb": [1, 1, 1]}}}]}
JSON
card=$(awk 'BEGIN { print 64 * 64 * (1.2 * 0.9 - 0.6 * -0.1) / 2 }')
wall=$(awk "BEGIN { print 128 * 128 - $card }")

build/release/bin/lightmill render "$folder/mattes.json" --local --spp 16 --layers id -o "$folder/mattes.exr"
failed=0
while read -r layer name exact; do
  "${LIGHTMILL_BLENDER:-blender}" --background --factory-startup --python-exit-code 3 \
    --python tests/bench/blender/read_matte.py -- "$folder/mattes.exr" 128x128 "$layer" "$name" "$folder/matte.exr" \
    >"$folder/matte.log" 2>&1 </dev/null || { tail "$folder/matte.log"; exit 1; }
  awk -v layer="$layer" -v exact="$exact" '
    $1 == "matte" { print layer, $2 ": " $3 " pixels in Blender, exactly " exact; good = ($3 - exact) ^ 2 <= 1 }
    END { exit !good }' "$folder/matte.log" || failed=1
done <<EOT
CryptoObject card $card
CryptoObject wall $wall
CryptoMaterial paper $card
CryptoMaterial paint $wall
EOT
exit $failed
