#!/bin/sh
# How long a farm is without a coordinator when the one at work is killed, stopped (SIGSTOP) or ends, and another stands by.
#
#   tests/bench/failover.sh postgres://…     a database that may be written to; bin/ of build/release is measured
set -eu
cd "$(dirname "$0")/../.."
server=build/release/bin/lightmill-server
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

start() { # NAME
  $server --store "$url" --listen 127.0.0.1:0 >"$folder/$1" 2>&1 &
}
until_says() { # NAME WORDS
  until grep -q "$2" "$folder/$1"; do sleep 0.02; done
}

url=$1
for signal in KILL STOP TERM; do
  start first
  first=$!
  until_says first 'listening on'
  start second
  second=$!
  until_says second 'standing by'
  sleep 2
  before=$(date +%s%N)
  kill -"$signal" "$first"
  until_says second 'listening on'
  echo "SIG$signal: $((($(date +%s%N) - before) / 1000000)) ms"
  kill -CONT "$first" 2>/dev/null || true
  wait "$first" || true
  kill -TERM "$second"
  wait "$second"
done
