#!/bin/sh
# Makes the Debian package and tries it in a fresh Debian: installs it, renders, runs the coordinator with its page, installs
# it over itself, removes and purges it, and compares what files there are before and after. Takes a minute or two, and
# fetches what the package depends on from the mirrors that apt knows here. As root, with mmdebstrap; exit code 77 without.
#
#   tests/deploy/package_test.sh [PACKAGE.deb]
set -eu

# In the fresh Debian this script calls itself: package_test.sh --inside PACKAGE.deb.
if [ "${1:-}" != --inside ]; then
  cd "$(dirname "$0")/../.."
  # shellcheck source=deploy/environment.sh
  . deploy/environment.sh
  if [ "$(id -u)" -ne 0 ] || ! command -v mmdebstrap >/dev/null; then
    echo 'package_test.sh: this takes root and mmdebstrap' >&2
    exit 77
  fi
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  trap 'exit 130' INT TERM
  if [ "$#" -gt 0 ]; then
    cp "$1" "$work/lightmill.deb"
  else
    [ -e build/release/build.ninja ] || cmake --preset release -DLIGHTMILL_TESTS=OFF
    cmake --build build/release --target lightmill lightmill-server lightmill-worker lightmill-images lightmill-docs lightmill-web
    (cd build/release && cpack -G DEB -B "$work")
    mv "$work"/lightmill_*.deb "$work/lightmill.deb"
  fi
  cp "$0" "$work/package_test.sh"
  # shellcheck source=/dev/null
  suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
  mkdir "$work/sources"
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
    [ ! -e "$file" ] || cp "$file" "$work/sources/"
  done
  cat "$work"/sources/* >"$work/all-sources"
  # shellcheck disable=SC2016  # $1 is the hook's
  mmdebstrap --quiet --variant=apt --format=null --customize-hook="copy-in $work/lightmill.deb $work/package_test.sh /srv" \
    --customize-hook='chroot "$1" sh /srv/package_test.sh --inside /srv/lightmill.deb' "$suite" /dev/null - <"$work/all-sources"
  echo 'the package installs, works, and leaves nothing behind'
  exit 0
fi

package=$2
export DEBIAN_FRONTEND=noninteractive LC_ALL=C

fail() {
  echo "package_test.sh: $*" >&2
  exit 1
}

# files: all that a package could leave; not what dpkg and adduser keep for themselves.
files() {
  find / -xdev \( -path /proc -o -path /sys -o -path /dev -o -path /run -o -path /tmp -o -path /srv -o -path /var/log -o -path /var/cache \
    -o -path /var/lib/dpkg -o -path /var/lib/apt \) -prune -o -print | grep -Ev '^/etc/(passwd|group|g?shadow|sub[ug]id)-$' | sort
}

# same_as_before: whether nothing was left, of files and users.
same_as_before() {
  files >/tmp/after
  diff /tmp/before /tmp/after || fail 'these files differ from before'
  diff /tmp/passwd-before /etc/passwd || fail 'these users differ from before'
}

depends=$(dpkg-deb -f "$package" Depends)
apt-get -q -y --no-install-recommends satisfy "$depends" >/tmp/apt.log 2>&1 || { cat /tmp/apt.log; fail 'its dependencies are not in Debian'; }
files >/tmp/before
cp /etc/passwd /tmp/passwd-before

echo '== install'
dpkg -i "$package"
version=$(dpkg-deb -f "$package" Version)
[ "$(lightmill --version)" = "lightmill $version" ] || fail "lightmill --version says $(lightmill --version)"
for program in lightmill-server lightmill-worker; do
  "$program" --version | grep -q "^$program $version " || fail "$program --version says $("$program" --version)"
done
for file in /usr/share/man/man1/lightmill-worker.1.gz /usr/share/bash-completion/completions/lightmill \
  /usr/lib/systemd/system/lightmill-worker@.service /etc/lightmill/server.conf /usr/share/doc/lightmill/copyright; do
  [ -s "$file" ] || fail "there is no $file"
done

echo '== render, as somebody who is not root'
mkdir -m 777 /tmp/pictures
# One scene has images, which a library beside the program looks into.
for scene in cornell-bench-blocks course-default; do
  setpriv --reuid=nobody --regid=nogroup --clear-groups env HOME=/tmp/pictures lightmill render --local --threads 2 --spp 4 --size 64x64 \
    "/usr/share/lightmill/scenes/$scene.json" -o "/tmp/pictures/$scene.png"
  [ "$(head -c 8 "/tmp/pictures/$scene.png" | od -An -tx1 | tr -d ' ')" = 89504e470d0a1a0a ] || fail "$scene.png is no PNG"
done

echo '== the coordinator, as its service runs it'
state=/var/lib/lightmill
install -d -m 700 -o lightmill -g lightmill "$state"
setpriv --reuid=lightmill --regid=lightmill --clear-groups env XDG_DATA_HOME=/var/lib lightmill-server --listen 127.0.0.1:0 \
  --http 127.0.0.1:0 >/tmp/server.log 2>&1 &
server=$!
tries=0
until grep -q 'the page is at' /tmp/server.log; do
  tries=$((tries + 1))
  if [ "$tries" -gt 300 ] || ! kill -0 "$server"; then
    cat /tmp/server.log
    fail 'the coordinator does not start'
  fi
  sleep 0.1
done
kill "$server"
wait "$server" || fail "the coordinator ended with $?"
! grep -q 'without the page' /tmp/server.log || fail 'the page is missing'
[ -s "$state/lightmill.sqlite" ] || fail "no state in $state"

echo '== install over itself: what an administrator has set stays'
echo '# mine' >>/etc/lightmill/server.conf
dpkg -i "$package"
grep -q '^# mine$' /etc/lightmill/server.conf || fail 'server.conf was overwritten'

echo '== remove: settings and state stay'
dpkg --remove lightmill
for file in /usr/bin/lightmill /usr/lib/lightmill /usr/share/lightmill; do
  if [ -e "$file" ] || [ -L "$file" ]; then
    fail "$file is still there"
  fi
done
[ -s /etc/lightmill/server.conf ] || fail 'server.conf is gone'

echo '== purge: state stays, and whose it is'
dpkg --purge lightmill
[ -s "$state/lightmill.sqlite" ] || fail 'the state is gone'
[ "$(stat -c %U "$state")" = lightmill ] || fail "the state is nobody's"
! getent passwd lightmill-worker >/dev/null || fail 'the user lightmill-worker is left'
rm -r "$state"
files >/tmp/after
diff /tmp/before /tmp/after || fail 'these files differ from before'

echo '== once more, without state: nothing stays'
dpkg -i "$package"
dpkg --purge lightmill
same_as_before
