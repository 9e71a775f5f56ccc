#!/bin/sh
# Fuzzes the readers of files and bytes, one program per core at a time, or fewer where memory is short. See usage below.
# Interesting inputs stay in build/fuzz/inputs, and the next run continues from them.
set -eu
cd "$(dirname "$0")/../.."
. deploy/environment.sh
. deploy/lock.sh

findings=build/fuzz/findings
seeded=$(sed -n 's/^lightmill_test(\([a-z]*\)_fuzz_tests .*/\1/p' tests/fuzz/CMakeLists.txt | xargs)

# is_seeded NAME
is_seeded() {
  case " $seeded " in *" $1 "*) ;; *) return 1 ;; esac
}

usage() {
  echo "usage: tests/fuzz/run.sh [SECONDS | --runs N] [NAME...]

Builds the fuzzers of readers and runs each for SECONDS (default 600), or for N inputs; with --runs also the
seeded fuzz tests of the release build: N requests, or N cases in each loop of the others.
NAME: some of $(ls tests/fuzz/libfuzzer | sed -n 's/_fuzzer\.cpp$//p' | tr '\n' ' ')(all if none is given) and, with --runs, of $seeded
Findings go to $findings. Exit codes: 0 no finding, 1 a finding or no build, 2 bad usage."
}

# is_count WORD
is_count() {
  case "$1" in '' | 0* | *[!0-9]*) return 1 ;; esac
}

# test_seeded LIMIT NAME: runs the GoogleTest program of this name.
test_seeded() {
  log=$findings/$2.log
  [ ! -d /dev/shm ] || export TMPDIR=/dev/shm # files by the million
  LIGHTMILL_FUZZ_CASES=${1#-runs=} "build/release/tests/$2_fuzz_tests" >"$log" 2>&1 || echo "$2: failed, see $log" | tee -a "$findings/failed"
  sed -n "s/^\[  PASSED  \]/$2: passed with ${1#-runs=} cases,/p" "$log"
}

# fuzz LIMIT NAME: runs one fuzzer; LIMIT is an option of libFuzzer.
fuzz() {
  if is_seeded "$2"; then
    test_seeded "$1" "$2"
    return
  fi
  mkdir -p "build/fuzz/inputs/$2"
  log=$findings/$2.log
  "build/fuzz/bin/$2_fuzzer" "$1" -timeout=20 -max_len=8192 -print_final_stats=1 \
    -artifact_prefix="$findings/$2-" -dict="tests/fuzz/libfuzzer/$2.dict" \
    "build/fuzz/inputs/$2" "tests/fuzz/seeds/$2" >"$log" 2>&1 || echo "$2: failed, see $log" | tee -a "$findings/failed"
  sed -n "s/^stat::number_of_executed_units: */$2: executed inputs: /p; s/^SUMMARY:/$2:/p" "$log"
}

limit=-max_total_time=600
case "${1:-}" in
  --one)
    fuzz "$2" "$3"
    exit
    ;;
  -h | --help)
    usage
    exit
    ;;
  --runs)
    is_count "${2:-}" || { usage >&2; exit 2; }
    limit=-runs=$2
    shift 2
    ;;
  *)
    if is_count "${1:-}"; then
      limit=-max_total_time=$1
      shift
    fi
    ;;
esac
for name in "$@"; do
  [ -e "tests/fuzz/libfuzzer/${name}_fuzzer.cpp" ] || { is_seeded "$name" && [ "${limit#-runs}" != "$limit" ]; } || { echo "$0: there is no fuzzer '$name'" >&2; usage >&2; exit 2; }
done

deploy/setup --tests
lock_builds || exit 1
compilers=$(python3 -B tests/runner/compilers.py)
cmake --preset fuzz >/dev/null
ninja -j "$compilers" -C build/fuzz fuzzers
if [ "${limit#-runs}" != "$limit" ]; then
  cmake --preset release >/dev/null
  # shellcheck disable=SC2046,SC2086  # one word per program
  ninja -j "$compilers" -C build/release $(printf 'tests/%s_fuzz_tests ' $seeded)
fi
unlock_builds
if [ $# -eq 0 ]; then
  for program in build/fuzz/bin/*_fuzzer; do
    name=${program##*/}
    set -- "$@" "${name%_fuzzer}"
  done
  [ "${limit#-runs}" = "$limit" ] || set -- "$@" $seeded
fi

rm -rf "$findings"
mkdir -p "$findings"
printf '%s\n' "$@" | xargs -n 1 -P "$compilers" tests/fuzz/run.sh --one "$limit"
if [ -e "$findings/failed" ]; then
  exit 1
fi
echo 'no finding'
