#!/bin/sh
# Builds Lightmill and runs its tests. docs/development.md explains what runs when.
#
#   ./test.sh                     everything that guards a change
#   ./test.sh NAME...             builds and runs the programs, labels or tests whose names match, e.g. film, web, SameBits
#   ./test.sh --all               everything: also long tests, all sanitizers and the fuzzers. Runs in pieces. A second
#                                 call for the same sources continues where the first one stopped.
#   ./test.sh --all --background  the same in the background
#   ./test.sh --all --minutes N   stops after N minutes and lists the pieces that are left
#   ./test.sh --repeat N --busy M the default suite N times, the last M beside busy loops; continues like --all
#   ./test.sh --status            what --all and --repeat have done so far
#   ./test.sh --list              the pieces of --all
#   ./test.sh --coverage          which lines the default suite runs, by folder; with --all, the long tests too
set -eu
cd "$(dirname "$0")"
. deploy/environment.sh
deploy/setup --tests
exec /usr/bin/python3 -B tests/runner "$@"
