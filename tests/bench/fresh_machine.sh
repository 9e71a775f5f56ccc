#!/bin/sh
# Times commands on a fresh machine: a minimal Debian in its own folder, with a clone of this repository, an empty environment and
# an empty compiler cache. Each command runs twice: cold, then warm. Packages come from the mirrors in this machine's apt and npm
# settings. Needs root, mmdebstrap, 25 GiB of disk, and as long as the commands take.
#
#   tests/bench/fresh_machine.sh [--commit COMMIT] ["./quickstart.sh --once" ./test.sh ...]
set -eu

# In the fresh Debian this script calls itself: fresh_machine.sh --inside COMMAND...
if [ "${1:-}" = --inside ]; then
  shift
  cd /srv/lightmill
  code=0
  for command in "$@"; do
    for state in cold warm; do
      echo "#### $command, $state"
      began=$(date +%s)
      sh -c "$command" || { code=$?; echo "#### it failed with $code"; }
      echo "#### $command, $state: $(($(date +%s) - began)) s"
    done
  done
  exit "$code"
fi

cd "$(dirname "$0")/../.."
commit=HEAD
if [ "${1:-}" = --commit ]; then
  commit=$2
  shift 2
fi
[ "$#" -gt 0 ] || set -- './quickstart.sh --once' ./test.sh
if [ "$(id -u)" -ne 0 ] || ! command -v mmdebstrap >/dev/null; then
  echo 'fresh_machine.sh: needs root and mmdebstrap' >&2
  exit 1
fi
work=$(mktemp -d -p /var/tmp)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
git clone -q --no-hardlinks . "$work/lightmill"
git -C "$work/lightmill" checkout -q "$(git rev-parse "$commit")"
cp "$0" "$work/fresh_machine.sh"
mkdir "$work/sources" "$work/settings"
for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
  [ ! -e "$file" ] || cp "$file" "$work/sources/"
done
cat "$work"/sources/* >"$work/all-sources"
cp "$(npm config get globalconfig)" "$work/settings/npmrc" 2>/dev/null || : >"$work/settings/npmrc"
# shellcheck source=/dev/null
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
quoted=
for command in "$@"; do
  quoted="$quoted '$command'"
done
TMPDIR=/var/tmp mmdebstrap --quiet --variant=apt --include=git,ca-certificates --format=null \
  --customize-hook="copy-in $work/lightmill $work/fresh_machine.sh /srv" \
  --customize-hook="copy-in $work/settings/npmrc /etc" \
  --customize-hook="cp -r /etc/ssl/certs \"\$1/etc/ssl/\" && cp /etc/hosts /etc/resolv.conf \"\$1/etc/\"" \
  --customize-hook="chroot \"\$1\" env -i HOME=/root NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh /srv/fresh_machine.sh --inside $quoted" \
  "$suite" /dev/null - <"$work/all-sources"
