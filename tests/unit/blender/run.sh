#!/bin/sh
# Runs the tests of the exporter in Blender. Skips if Blender or its numpy is not installed.
set -eu
blender=${LIGHTMILL_BLENDER:-blender}
if ! command -v "$blender" >/dev/null; then
  echo "Blender is not installed (deploy/setup --blender)"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
TMPDIR=$folder "$blender" --background --factory-startup --disable-autoexec --python-exit-code 3 \
  --python "$(dirname "$0")/run_tests.py"
