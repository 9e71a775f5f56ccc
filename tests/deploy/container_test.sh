#!/bin/sh
# Makes the image of deploy/containers from the Debian package, on a fresh Debian in place of the slim image that a registry
# would give, and runs a farm in it as a cluster would: nobody root, the root read-only. Takes some minutes, and fetches what
# the package depends on from the mirrors that apt knows here. As root, with mmdebstrap and buildah; exit code 77 without.
#
#   tests/deploy/container_test.sh [PACKAGE.deb]
set -eu

fail() {
  echo "container_test.sh: $*" >&2
  exit 1
}

# In the image this script calls itself: container_test.sh --inside ROOT, in a mount namespace of its own.
if [ "${1:-}" = --inside ]; then
  root=$2
  mount --bind "$root" "$root"
  # as USER COMMAND...: in the image, without rights beyond the user's.
  as() {
    user=$1
    shift
    chroot "$root" setpriv --reuid="$user" --regid="$user" --clear-groups --no-new-privs --bounding-set=-all \
      env -i PATH=/usr/bin:/bin XDG_DATA_HOME=/var/lib "$@"
  }
  mount -t proc proc "$root/proc"
  mount -t tmpfs -o mode=1777 tmp "$root/tmp"
  [ "$(stat -c '%u %a' "$root/var/lib/lightmill")" = '7350 700' ] || fail 'the state is another user'\''s'
  mount -t tmpfs -o mode=700,uid=7350,gid=7350 state "$root/var/lib/lightmill"
  mount -o remount,bind,ro "$root"
  if as 7350 touch /etc/mine 2>/dev/null; then
    fail 'its root can be written'
  fi

  echo '== the programs'
  for program in lightmill lightmill-server lightmill-worker; do
    as 7351 "$program" --version
  done

  echo '== a farm with certificates'
  certs() {
    as 7350 lightmill certs "$@" >/dev/null
  }
  certs init /tmp/certs
  certs server /tmp/certs localhost
  certs person /tmp/certs ada --roles admin
  as 7351 mkdir /tmp/worker
  certs worker /tmp/certs worker
  # What a secret's group would let the worker read.
  cp "$root/tmp/certs/worker.pem" "$root/tmp/worker/worker.pem"
  chown 7351 "$root/tmp/worker/worker.pem"
  cp "$root/tmp/certs/ca.pem" "$root/tmp/worker/ca.pem"
  chmod 644 "$root/tmp/worker/ca.pem"
  (as 7350 lightmill-server --data=/var/lib/lightmill --listen=127.0.0.1:0 --port-file=/tmp/certs/port --http=127.0.0.1:0 \
    --health=127.0.0.1:0 --tls-cert=/tmp/certs/server.pem --tls-ca=/tmp/certs/ca.pem) >"$root/tmp/server.log" 2>&1 &
  tries=0
  until [ -s "$root/tmp/certs/port" ] && grep -q 'the page is at https' "$root/tmp/server.log"; do
    tries=$((tries + 1))
    if [ "$tries" -gt 300 ]; then
      cat "$root/tmp/server.log"
      fail 'the coordinator does not start'
    fi
    sleep 0.1
  done
  ! grep -q 'without the page' "$root/tmp/server.log" || fail 'the page is missing'
  farm=localhost:$(cat "$root/tmp/certs/port")
  (as 7351 lightmill-worker "--server=$farm" --tls-ca=/tmp/worker/ca.pem --tls-cert=/tmp/worker/worker.pem --threads=1) \
    >"$root/tmp/worker.log" 2>&1 &
  # One scene has images, which a library beside the program looks into.
  for scene in cornell-bench-blocks course-default; do
    as 7350 lightmill render --server "$farm" --tls-ca /tmp/certs/ca.pem --tls-cert /tmp/certs/ada.pem --spp 4 --size 64x64 \
      "/usr/share/lightmill/scenes/$scene.json" -o "/tmp/certs/$scene.png" || { cat "$root/tmp/worker.log"; fail "$scene"; }
    [ "$(head -c 8 "$root/tmp/certs/$scene.png" | od -An -tx1 | tr -d ' ')" = 89504e470d0a1a0a ] || fail "$scene.png is no PNG"
  done
  # The namespace of processes ends with this script, and they with it.
  exit 0
fi

cd "$(dirname "$0")/../.."
# shellcheck source=deploy/environment.sh
. deploy/environment.sh
if [ "$(id -u)" -ne 0 ] || ! command -v mmdebstrap >/dev/null || ! command -v buildah >/dev/null; then
  echo 'container_test.sh: this takes root, mmdebstrap and buildah' >&2
  exit 77
fi
work=$(mktemp -d)
mkdir "$work/context"
# image ARGUMENTS...: buildah, with all that it keeps in the test's own folder.
image() {
  buildah --root "$work/storage" --runroot "$work/run" --storage-driver vfs "$@"
}
container=
clean_up() {
  [ -z "$container" ] || image umount "$container" >/dev/null || true
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 130' INT TERM
if [ "$#" -gt 0 ]; then
  cp "$1" "$work/context/lightmill_0_amd64.deb"
else
  [ -e build/release/build.ninja ] || cmake --preset release -DLIGHTMILL_TESTS=OFF
  cmake --build build/release --target lightmill lightmill-server lightmill-worker lightmill-images lightmill-docs lightmill-web
  (cd build/release && cpack -G DEB -B "$work/package")
  mv "$work"/package/lightmill_*.deb "$work/context/"
fi

echo '== a Debian to begin with'
# shellcheck source=/dev/null
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
mkdir "$work/sources"
for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
  [ ! -e "$file" ] || cp "$file" "$work/sources/"
done
cat "$work"/sources/* >"$work/all-sources"
mmdebstrap --quiet --variant=apt "$suite" "$work/base.tar" - <"$work/all-sources"
base=$(image from scratch)
image add --quiet "$base" "$work/base.tar" / >/dev/null
image commit --quiet "$base" localhost/base >/dev/null
image rm "$base" >/dev/null
rm "$work/base.tar"

echo '== the image'
image build --isolation chroot --build-arg BASE=localhost/base --tag lightmill -f deploy/containers/Containerfile "$work/context"
container=$(image from --pull-never lightmill)
config=$(image inspect --format '{{.OCIv1.Config.User}} {{.OCIv1.Config.Cmd}}' "$container")
[ "$config" = '7350:7350 [lightmill --help]' ] || fail "it would run $config"
root=$(image mount "$container")
du -sm "$root" | cut -f 1 | sed 's/$/ MiB/'
unshare --mount --pid --fork --kill-child sh tests/deploy/container_test.sh --inside "$root"
echo 'the image runs a farm'
