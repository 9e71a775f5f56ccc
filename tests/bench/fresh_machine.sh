#!/bin/sh
# Times commands on a fresh machine: a minimal Debian in its own folder, with an empty environment. Each command has a new clone of
# this repository and an empty compiler cache, and runs twice: cold, then warm. The first one installs the packages, too. They come
# from the mirrors in this machine's apt and npm settings. Needs root, mmdebstrap, 25 GiB of disk, and as long as the commands take.
#
#   tests/bench/fresh_machine.sh [--commit COMMIT] ["./quickstart.sh --once" ./test.sh ...]
set -eu

# In the fresh Debian this script calls itself: fresh_machine.sh --inside. The file `commands` has one on each line.
if [ "${1:-}" = --inside ]; then
  code=0
  while IFS= read -r command <&3; do
    cd /srv
    rm -rf clone cache
    git clone -q lightmill clone
    cd clone
    export CCACHE_DIR=/srv/cache
    for state in cold warm; do
      echo "#### $command, $state"
      began=$(date +%s)
      sh -c "$command" || { code=$?; echo "#### it failed with $code"; }
      echo "#### $command, $state: $(($(date +%s) - began)) s"
    done
  done 3</srv/commands
  exit "$code"
fi

cd "$(dirname "$0")/../.."
commit=HEAD
if [ "${1:-}" = --commit ]; then
  commit=$2
  shift 2
fi
[ "$#" -gt 0 ] || set -- './quickstart.sh --once' ./test.sh
# shellcheck source=tests/support/fresh_debian.sh
. tests/support/fresh_debian.sh
need_root_and mmdebstrap
work=$(mktemp -d -p /var/tmp)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
git clone -q --no-hardlinks . "$work/lightmill"
git -C "$work/lightmill" checkout -q "$(git rev-parse "$commit")"
cp tests/bench/fresh_machine.sh "$work"
mkdir "$work/settings"
cp "$(npm config get globalconfig)" "$work/settings/npmrc" 2>/dev/null || : >"$work/settings/npmrc"
printf '%s\n' "$@" >"$work/commands"
TMPDIR=/var/tmp
export TMPDIR
make_debian /dev/null --variant=apt --include=git,ca-certificates --format=null \
  --customize-hook="copy-in $work/lightmill $work/fresh_machine.sh $work/commands /srv" \
  --customize-hook="copy-in $work/settings/npmrc /etc" \
  --customize-hook="cp -r /etc/ssl/certs \"\$1/etc/ssl/\" && cp /etc/hosts /etc/resolv.conf \"\$1/etc/\"" \
  --customize-hook="chroot \"\$1\" env -i HOME=/root NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh /srv/fresh_machine.sh --inside"
