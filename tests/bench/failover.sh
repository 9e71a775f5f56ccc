#!/bin/sh
# Measures how long a farm has no coordinator when the active one is killed, stopped (SIGSTOP) or ends, and a standby takes over.
#
#   tests/bench/failover.sh postgres://… [ROUNDS [FOLDER]]   a database that may be written to; bin/ of build/release is
#   measured. With a folder for the times, the same command continues after an interruption.
set -eu
cd "$(dirname "$0")/../.."
server=build/release/bin/lightmill-server
usage='usage: tests/bench/failover.sh postgres://USER@HOST/DATABASE [ROUNDS [FOLDER]]

Prints how long a farm has no coordinator when the active one is killed, stopped, or ends, and a standby takes over: the
shortest and the longest of ROUNDS times (3). It writes to the database, and measures build/release/bin/lightmill-server.
The times are kept in FOLDER. The same command continues there.'
case "${1:-}" in -h | --help) echo "$usage"; exit ;; esac
[ $# -ge 1 ] && [ $# -le 3 ] || { echo "$usage" >&2; exit 2; }
url=$1
rounds=${2:-3}
folder=$(mktemp -d)
times=${3:-$folder}
mkdir -p "$times"
first=
second=
clean_up() {
  for process in $first $second; do
    kill -CONT "$process" 2>/dev/null || true
    kill -KILL "$process" 2>/dev/null || true # usually it has ended
  done
  rm -rf "$folder"
}
trap clean_up EXIT
trap 'exit 130' INT TERM

start() { # NAME
  : >"$folder/$1" # replaces that of the round before
  $server --store "$url" --listen 127.0.0.1:0 >>"$folder/$1" 2>&1 &
}
until_says() { # NAME PROCESS WORDS
  until grep -q "$3" "$folder/$1"; do
    kill -0 "$2" 2>/dev/null || { echo "$0: the $1 coordinator ended:" >&2; cat "$folder/$1" >&2; exit 1; }
    sleep 0.02
  done
}

for signal in KILL STOP TERM; do
  touch "$times/SIG$signal"
  while [ "$(wc -l <"$times/SIG$signal")" -lt "$rounds" ]; do
    start first
    first=$!
    until_says first "$first" 'listening on'
    start second
    second=$!
    until_says second "$second" 'on standby'
    sleep 1
    before=$(date +%s%N)
    kill -"$signal" "$first"
    until_says second "$second" 'listening on'
    echo "$((($(date +%s%N) - before) / 1000000))" >>"$times/SIG$signal"
    kill -CONT "$first" 2>/dev/null || true # a killed one is gone
    wait "$first" || true # killed, or deposed, which ends it with an error
    kill -TERM "$second"
    wait "$second"
  done
  sort -n "$times/SIG$signal" | awk -v name="SIG$signal" \
    '{ if (NR == 1) least = $1 } END { printf "%s: %d times, %d to %d ms\n", name, NR, least, $1 }'
done
