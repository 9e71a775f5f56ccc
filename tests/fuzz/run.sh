#!/bin/sh
# Fuzzes the readers of files and bytes: builds the libFuzzer programs and runs each for SECONDS (600 if not given), as many
# at once as there are cores. What they find lies in build/fuzz/findings; interesting inputs are kept in build/fuzz/inputs
# and gone on from the next time.
#
#   tests/fuzz/run.sh [SECONDS [NAME...]]
set -eu
cd "$(dirname "$0")/../.."
. deploy/environment.sh

findings=build/fuzz/findings

# fuzz SECONDS NAME: one of them.
fuzz() {
  mkdir -p "build/fuzz/inputs/$2"
  log=$findings/$2.log
  "build/fuzz/bin/$2_fuzzer" -max_total_time="$1" -timeout=20 -max_len=8192 -print_final_stats=1 \
    -artifact_prefix="$findings/$2-" -dict="tests/fuzz/libfuzzer/$2.dict" \
    "build/fuzz/inputs/$2" "tests/fuzz/seeds/$2" >"$log" 2>&1 || echo "$2: failed, see $log" | tee -a "$findings/failed"
  sed -n "s/^stat::number_of_executed_units: */$2: executed inputs: /p; s/^SUMMARY:/$2:/p" "$log"
}

if [ "${1:-}" = --one ]; then
  fuzz "$2" "$3"
  exit
fi

seconds=${1:-600}
[ $# -eq 0 ] || shift
deploy/setup --tests
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz
if [ $# -eq 0 ]; then
  for program in build/fuzz/bin/*_fuzzer; do
    name=${program##*/}
    set -- "$@" "${name%_fuzzer}"
  done
fi

rm -rf "$findings"
mkdir -p "$findings"
printf '%s\n' "$@" | xargs -n 1 -P "$(nproc)" tests/fuzz/run.sh --one "$seconds"
if [ -e "$findings/failed" ]; then
  exit 1
fi
echo 'no finding'
