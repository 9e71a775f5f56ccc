#!/bin/sh
# Builds everything and runs the tests: all of them in release (the web page in a browser too), the fast ones again under
# the address and undefined-behaviour sanitizers, those with several threads under ThreadSanitizer, and the fuzzers for
# seconds. --all adds the long runs, and runs all unit, simulation and statistical tests under ThreadSanitizer. Where all has
# to be compiled, on a slow machine, --minutes N leaves out what the sanitizers and fuzzers are not compiled for by then,
# and says so.
#
#   ./test.sh [--all] [--minutes N]
set -eu
cd "$(dirname "$0")"
. deploy/environment.sh

skip='long|bench'
threaded='threads'
threaded_programs=thread_tests
minutes=0
usage() {
  echo "usage: ./test.sh [--all] [--minutes N]" >&2
  exit 2
}
while [ $# -gt 0 ]; do
  case "$1" in
    --all)
      skip='bench'
      threaded='threads|unit|simulation|statistical'
      threaded_programs=all_thread_tests
      ;;
    --minutes)
      shift
      case "${1:-}" in '' | 0* | *[!0-9]*) usage ;; esac
      minutes=$1
      ;;
    *) usage ;;
  esac
  shift
done

started=$(date +%s)
cores=$(nproc)
# Real processes and real clocks: one test at a time, and again if another program had the machine just then. The
# summary names those that took it.
alone='integration'
sanitized='unit|fuzz|simulation'
summaries=
failed=0

# run_tests PRESET CTEST-ARGUMENTS...: runs them all even if some fail, and keeps the summary for the end.
run_tests() {
  preset=$1
  shift
  log=build/$preset/test.log
  { ctest --test-dir "build/$preset" --output-on-failure --no-tests=error "$@" 2>&1 || echo failed >"$log.failed"; } | tee "$log"
  if [ -e "$log.failed" ]; then
    rm "$log.failed"
    failed=1
  fi
  summaries="$summaries
$preset ($*): $(grep -E '^[0-9]+% tests passed' "$log" || echo 'no summary')$(failures_of "$log")"
}

# failures_of LOG: each test that failed, if only at first, and the end of what it said.
failures_of() {
  awk '
    function told() { for (i = said > 40 ? said - 40 : 0; i < said; ++i) print "    " lines[i]; said = 0 }
    /^ *Start +[0-9]+:|^[0-9]+% tests passed/ { if (inside) told(); inside = 0 }
    inside { lines[said++] = substr($0, 1, 300) }
    /Test +#[0-9]+:.*\*\*\*/ && !/\*\*\*Skipped/ { printf "\n  %s\n", $0; inside = 1 }
  ' "$1"
}

# configure PRESET: quietly, unless it fails.
configure() {
  mkdir -p "build/$1"
  cmake --preset "$1" -DLIGHTMILL_TESTS=ON >"build/$1/configure.log" 2>&1 || { cat "build/$1/configure.log"; exit 1; }
}

# compiled PART PRESET TARGET: whether there was time to compile what a part needs; if not, the summary says that it is
# left out.
compiled() {
  part=$1
  preset=$2
  limit=
  left=1
  if [ "$minutes" -gt 0 ]; then
    left=$((started + minutes * 60 - $(date +%s)))
    limit="timeout --foreground $left"
  fi
  if [ "$left" -gt 0 ]; then
    echo "== $part"
    configure "$preset"
    status=0
    $limit ninja -C "build/$preset" "$3" || status=$?
    case "$status" in
      0) return 0 ;;
      124) ;;  # timeout's
      *) exit "$status" ;;
    esac
  fi
  summaries="$summaries
left out, as it is not compiled after $minutes minutes: $part"
  return 1
}

deploy/setup --tests

echo '== release'
configure release
cmake --build build/release
run_tests release -LE "$skip|$alone" -j "$cores"
run_tests release -L "$alone" -LE "$skip" --repeat until-pass:2

if compiled 'address and undefined-behaviour sanitizers' asan sanitized_tests; then
  run_tests asan -L "$sanitized" -LE "$skip|$alone" -j "$cores"
fi

# A race that shows one time in two is one, so nothing is tried again.
if compiled 'thread sanitizer' tsan "$threaded_programs"; then
  run_tests tsan -L "$threaded" -LE "$skip|$alone" -j "$cores"
  run_tests tsan -L "$threaded" -L "$alone" -LE "$skip"
fi

if compiled fuzzers fuzz fuzzers; then
  run_tests fuzz -j "$cores"
fi

echo
echo "== summary$summaries"
if [ "$failed" -ne 0 ]; then
  echo 'some tests failed'
  exit 1
fi
