#!/bin/sh
# Builds the two images of deploy/containers from the Debian packages, on a fresh Debian instead of a registry's slim image.
# Prints their sizes, and runs a farm of them like a cluster: no root user, read-only roots. Takes some minutes, and downloads
# dependencies from this machine's apt mirrors. Needs root, mmdebstrap and buildah, else exit code 77.
#
#   tests/deploy/container_test.sh [FOLDER-WITH-PACKAGES]
set -eu

fail() {
  echo "container_test.sh: $*" >&2
  exit 1
}

# Size limit of the coordinator's image: the size in docs/operate/kubernetes.md, and a margin for Debian's updates.
most_server_mib=150

# With the images this script calls itself in its own namespaces: container_test.sh --inside FOLDER. FOLDER has the images' roots.
if [ "${1:-}" = --inside ]; then
  work=$2
  server=$work/server
  worker=$work/worker
  client=$work/client/usr/bin/lightmill
  certs=$work/certs
  # as USER ROOT COMMAND...: runs in an image, with only the user's rights.
  as() {
    user=$1
    root=$2
    shift 2
    chroot "$root" setpriv --reuid="$user" --regid="$user" --clear-groups --no-new-privs --bounding-set=-all \
      env -i PATH=/usr/bin:/bin XDG_DATA_HOME=/var/lib XDG_STATE_HOME=/var/lib "$@"
  }
  [ "$(stat -c '%u %a' "$server/var/lib/lightmill")" = '7350 700' ] || fail 'the state belongs to another user'
  [ "$(stat -c '%u %a' "$worker/var/lib/lightmill-worker")" = '7351 700' ] || fail 'the tokens belong to another user'
  for root in "$server" "$worker"; do
    mount --bind "$root" "$root"
    mount -t proc proc "$root/proc"
    mount -t tmpfs -o mode=1777 tmp "$root/tmp"
  done
  mount -t tmpfs -o mode=700,uid=7350,gid=7350 state "$server/var/lib/lightmill"
  mount -t tmpfs -o mode=700,uid=7351,gid=7351 state "$worker/var/lib/lightmill-worker"
  mount -o remount,bind,ro "$server"
  mount -o remount,bind,ro "$worker"
  for root in "$server" "$worker"; do
    ! touch "$root/etc/mine" 2>/dev/null || fail "$root is writable"
  done

  echo '== the programs'
  as 7350 "$server" lightmill-server --version
  as 7351 "$worker" lightmill-worker --version
  # The worker's image omits some files of Debian's packages.
  as 7351 "$worker" ldd /usr/lib/lightmill/lightmill-worker /usr/lib/lightmill/lightmill-image-decoder >"$worker/tmp/libraries"
  ! grep 'not found' "$worker/tmp/libraries" || fail 'the worker lacks these libraries'

  echo '== a farm with certificates'
  "$client" certs init "$certs" >/dev/null
  "$client" certs server "$certs" localhost >/dev/null
  "$client" certs person "$certs" ada --roles admin >/dev/null
  # The files that a secret's group would let them read.
  install -m 400 -o 7350 "$certs/ca.pem" "$certs/server.pem" "$server/tmp/"
  (as 7350 "$server" lightmill-server --data=/var/lib/lightmill --listen=127.0.0.1:0 --port-file=/tmp/port --http=127.0.0.1:0 \
    --health=127.0.0.1:0 --tls-cert=/tmp/server.pem --tls-ca=/tmp/ca.pem) >"$server/tmp/log" 2>&1 &
  tries=0
  until [ -s "$server/tmp/port" ] && grep -q 'the page is at https' "$server/tmp/log"; do
    tries=$((tries + 1))
    if [ "$tries" -gt 300 ]; then
      cat "$server/tmp/log"
      fail 'the coordinator does not start'
    fi
    sleep 0.1
  done
  ! grep -q 'without the page' "$server/tmp/log" || fail 'the page is missing'
  farm=localhost:$(cat "$server/tmp/port")
  "$client" tokens create worker --enrol 1 --out "$certs/worker.enrol" \
    --server "$farm" --tls-ca "$certs/ca.pem" --tls-cert "$certs/ada.pem" >/dev/null
  install -m 400 -o 7351 "$certs/ca.pem" "$certs/worker.enrol" "$worker/tmp/"
  (as 7351 "$worker" lightmill-worker "--server=$farm" --tls-ca=/tmp/ca.pem --enrol-file=/tmp/worker.enrol --threads=1) \
    >"$worker/tmp/log" 2>&1 &
  # One scene has images.
  for scene in cornell-bench-blocks course-default; do
    "$client" render --server "$farm" --tls-ca "$certs/ca.pem" --tls-cert "$certs/ada.pem" --spp 4 --size 64x64 \
      "$work/client/usr/share/lightmill/scenes/$scene.json" -o "$certs/$scene.png" || { cat "$worker/tmp/log"; fail "$scene"; }
    [ "$(head -c 8 "$certs/$scene.png" | od -An -tx1 | tr -d ' ')" = 89504e470d0a1a0a ] || fail "$scene.png is no PNG"
  done
  [ -s "$worker/var/lib/lightmill-worker/1/token" ] || fail 'the worker has not kept its token'
  # The process namespace ends with this script, and with it the programs.
  exit 0
fi

cd "$(dirname "$0")/../.."
# shellcheck source=tests/support/fresh_debian.sh
. tests/support/fresh_debian.sh
need_root_and mmdebstrap buildah
work=$(mktemp -d)
mkdir "$work/context"
# image ARGUMENTS...: buildah with its storage in the test's folder.
image() {
  buildah --root "$work/storage" --runroot "$work/run" --storage-driver vfs "$@"
}
clean_up() {
  image umount --all >/dev/null 2>&1 || true
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 130' INT TERM
if [ "$#" -gt 0 ]; then
  cp "$1"/lightmill*.deb "$work/context/"
else
  build_packages "$work/context"
fi
# The client is in no image. It runs on this machine.
mkdir "$work/client"
for package in "$work"/context/lightmill_*.deb "$work"/context/lightmill-image-decoder_*.deb; do
  dpkg-deb -x "$package" "$work/client"
done

echo '== a fresh Debian'
# With the contents of the slim image, and without what it omits.
make_debian "$work/base.tar" --variant=minbase --include=usr-is-merged --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr \
  --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-include=/usr/share/doc/*/copyright' \
  --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/info/*' \
  --dpkgopt='path-exclude=/usr/share/locale/*'
base=$(image from scratch)
image add --quiet "$base" "$work/base.tar" / >/dev/null
image commit --quiet "$base" localhost/base >/dev/null
image rm "$base" >/dev/null
rm "$work/base.tar"

for name in server worker; do
  echo "== the $name's image"
  image build --isolation chroot --build-arg BASE=localhost/base --target "$name" --tag "lightmill-$name" \
    -f deploy/containers/Containerfile "$work/context"
  container=$(image from --pull-never "lightmill-$name")
  config=$(image inspect --format '{{.OCIv1.Config.User}} {{.OCIv1.Config.Cmd}}' "$container")
  case "$name $config" in
    'server 7350:7350 [lightmill-server --help]' | 'worker 7351:7351 [lightmill-worker --help]') ;;
    *) fail "its configuration is $config" ;;
  esac
  ln -s "$(image mount "$container")" "$work/$name"
  size=$(du -sm "$work/$name/" | cut -f 1)
  echo "$size MiB"
  [ "$name" = worker ] || [ "$size" -le "$most_server_mib" ] || fail "that is more than $most_server_mib MiB"
done
unshare --mount --pid --fork --kill-child --mount-proc sh tests/deploy/container_test.sh --inside "$work"
echo 'the images run a farm'
