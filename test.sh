#!/bin/sh
# Builds Lightmill and runs its tests. docs/development.md explains what runs when.
#
#   ./test.sh                     the default suite, before each commit
#   ./test.sh NAME...             programs, labels or tests whose names match, e.g. film, web, SameBits, long
#   ./test.sh asan NAME...        the same with the address sanitizer; also ubsan and tsan
#   ./test.sh 'PIECE'             a piece of --list, e.g. 'asan: unit'
#   ./test.sh --all               everything, in pieces; a second call continues where the first one stopped
#   ./test.sh --all --minutes N   stops after N minutes
#   ./test.sh --repeat N --busy M the default suite N times, the last M with busy loops on all cores
#   ./test.sh --status            what --all and --repeat have done
#   ./test.sh --list              the pieces of --all
#   ./test.sh --coverage          which lines the default suite runs; with --all, the long tests too
#
# --background needs --all or --repeat. --help has the rest.
set -eu
cd "$(dirname "$0")"
. deploy/environment.sh
unset COLUMNS # tests read whole lines
if [ ! -x /usr/bin/python3 ]; then
  case "${1:-}" in
    -h | --help)
      sed -n '2,16s/^# \{0,1\}//p' "$0"
      exit
      ;;
  esac
  deploy/setup --tests
fi
exec /usr/bin/python3 -B tests/runner "$@"
