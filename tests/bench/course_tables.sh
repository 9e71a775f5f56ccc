#!/bin/sh
# Prints the tables of docs/evidence/course.md: times with and without a BVH, and subdivisions of the pixel against time and
# error, compared with plain random sampling. Takes about ten minutes on a quiet core. Needs the models (scenes/get-models) and a
# build (ninja -C build/release course_bench).
#
#   tests/bench/course_tables.sh [OPTION …]     options go to course_bench: --runs 3, …
set -eu
cd "$(dirname "$0")/../.."
. deploy/environment.sh

case "${1:-}" in
  -h | --help)
    echo "usage: tests/bench/course_tables.sh [OPTION ...]

Prints the tables of docs/evidence/course.md, after it has fetched the models. Options go to course_bench:
"
    [ ! -x build/release/bench/course_bench ] || build/release/bench/course_bench --help
    exit
    ;;
esac

[ -x build/release/bench/course_bench ] || { echo "$0: build it first: ninja -C build/release course_bench" >&2; exit 2; }
scenes/get-models >&2
echo "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1), $(nproc) cores, one of them used; load $(cut -d ' ' -f 1 /proc/loadavg)."
echo
build/release/bench/course_bench "$@"
