#!/bin/sh
# Builds the Debian packages and tries them in a fresh Debian. Installs each alone, then all. Renders, and runs the coordinator
# with its page. Installs them over themselves, removes and purges them, and compares the files before and after. Takes some
# minutes, and downloads dependencies from this machine's apt mirrors. Needs root and mmdebstrap, else exit code 77.
#
#   tests/deploy/package_test.sh [FOLDER-WITH-PACKAGES]
set -eu

# In the fresh Debian this script calls itself: package_test.sh --inside FOLDER.
if [ "${1:-}" != --inside ]; then
  cd "$(dirname "$0")/../.."
  # shellcheck source=tests/support/fresh_debian.sh
  . tests/support/fresh_debian.sh
  need_root_and mmdebstrap
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  trap 'exit 130' INT TERM
  mkdir "$work/packages"
  if [ "$#" -gt 0 ]; then
    cp "$1"/lightmill*.deb "$work/packages/"
  else
    build_packages "$work/packages"
  fi
  cp tests/deploy/package_test.sh "$work"
  # shellcheck disable=SC2016  # $1 is the hook's
  make_debian /dev/null --variant=apt --format=null --customize-hook="copy-in $work/packages $work/package_test.sh /srv" \
    --customize-hook='chroot "$1" sh /srv/package_test.sh --inside /srv/packages'
  echo 'the packages install, work, and leave nothing behind'
  exit 0
fi

packages=$2
server=$(echo "$packages"/lightmill-server_*.deb)
worker=$(echo "$packages"/lightmill-worker_*.deb)
client=$(echo "$packages"/lightmill_*.deb)
decoder=$(echo "$packages"/lightmill-image-decoder_*.deb)
export DEBIAN_FRONTEND=noninteractive LC_ALL=C

fail() {
  echo "package_test.sh: $*" >&2
  exit 1
}

# fetch DEPENDENCIES: installs them.
fetch() {
  apt-get -q -y --no-install-recommends satisfy "$1" >/tmp/apt.log 2>&1 || { cat /tmp/apt.log; fail "Debian does not have: $1"; }
}

# files: all files that a package could leave, without those of dpkg and adduser.
files() {
  find / -xdev \( -path /proc -o -path /sys -o -path /dev -o -path /run -o -path /tmp -o -path /srv -o -path /var/log -o -path /var/cache \
    -o -path /var/lib/dpkg -o -path /var/lib/apt \) -prune -o -print | grep -Ev '^/etc/(passwd|group|g?shadow|sub[ug]id)-$' | sort
}

# same_as_before: whether no files and users remain.
same_as_before() {
  files >/tmp/after
  diff /tmp/before /tmp/after || fail 'these files differ from before'
  diff /tmp/passwd-before /etc/passwd || fail 'these users differ from before'
  diff /tmp/group-before /etc/group || fail 'these groups differ from before'
}

# enabled UNITS: whether exactly these units of the farm start with the machine.
enabled() {
  find /etc/systemd -name 'lightmill*' -printf '%f ' >/tmp/enabled
  [ "$(tr ' ' '\n' </tmp/enabled | sort | xargs)" = "$*" ] || fail "the enabled units are $(cat /tmp/enabled), not $*"
}

# asked WHAT: whether systemctl got exactly this request.
asked() {
  grep -qxF -e "$*" /tmp/systemctl.log || { cat /tmp/systemctl.log; fail "systemctl was not called with: $*"; }
}

# Each by itself, to check that its dependencies are enough, and that the coordinator needs no library that reads images. The
# image decoder, which two others need, comes after the coordinator and stays.
for package in "$server" "$worker" "$client"; do
  program=$(dpkg-deb -f "$package" Package)
  version=$(dpkg-deb -f "$package" Version)
  echo "== $program alone"
  if [ "$package" = "$worker" ]; then
    fetch "$(dpkg-deb -f "$decoder" Depends)"
    dpkg -i "$decoder"
  fi
  fetch "$(dpkg-deb -f "$package" Depends | sed 's/\(, \)\?lightmill-image-decoder ([^)]*)//; s/^, //')"
  dpkg -i "$package"
  "$program" --version >/tmp/version
  grep -q "^$program $version\( \|$\)" /tmp/version || fail "$program --version says $(cat /tmp/version)"
  for file in "/usr/share/man/man1/$program.1.gz" "/usr/share/bash-completion/completions/$program" "/usr/share/doc/$program/copyright"; do
    [ -s "$file" ] || fail "there is no $file"
  done
  if [ "$package" = "$server" ] && dpkg-query -W -f '${Package} ' 'libopenimageio*' 2>/dev/null; then
    fail 'the coordinator needs OpenImageIO'
  fi
  dpkg --purge "$program"
done
dpkg --purge lightmill-image-decoder

# systemd does not run here. systemctl only sets links.
fetch systemd
files >/tmp/before
cp /etc/passwd /tmp/passwd-before
cp /etc/group /tmp/group-before

echo '== install'
dpkg -i "$server" "$worker" "$client" "$decoder"
enabled

echo '== render, as a user other than root'
mkdir -m 777 /tmp/pictures
# One scene has images, which the decoder beside the program reads.
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
coordinator=$!
tries=0
until grep -q 'the page is at' /tmp/server.log; do
  tries=$((tries + 1))
  if [ "$tries" -gt 300 ] || ! kill -0 "$coordinator"; then
    cat /tmp/server.log
    fail 'the coordinator does not start'
  fi
  sleep 0.1
done
kill "$coordinator"
wait "$coordinator" || fail "the coordinator ended with $?"
! grep -q 'without the page' /tmp/server.log || fail 'the page is missing'
[ -s "$state/lightmill.sqlite" ] || fail "no state in $state"

echo '== reinstall while all calls of systemctl fail: settings of the administrator stay'
systemctl enable lightmill-server lightmill-worker lightmill-worker@a
enabled lightmill-server.service lightmill-worker.service lightmill-worker@a.service
echo '# mine' >>/etc/lightmill/server.conf
# Replaces systemctl on a machine with a running systemd.
mkdir -p /tmp/fail /run/systemd/system
cat >/tmp/fail/systemctl <<'END'
#!/bin/sh
echo "$*" >>/tmp/systemctl.log
case "$*" in
  *' disable '*) SYSTEMD_OFFLINE=1 exec /usr/bin/systemctl "$@" ;;
  *) exit 1 ;;
esac
END
chmod +x /tmp/fail/systemctl
PATH=/tmp/fail:$PATH dpkg -i "$server" "$worker" "$client" "$decoder"
asked daemon-reload
asked try-restart lightmill-server.service
asked 'try-restart lightmill-worker.service lightmill-worker@*.service'
grep -q '^# mine$' /etc/lightmill/server.conf || fail 'server.conf was overwritten'
enabled lightmill-server.service lightmill-worker.service lightmill-worker@a.service

echo '== remove, while systemctl fails: settings and state stay'
PATH=/tmp/fail:$PATH dpkg --remove lightmill lightmill-server lightmill-worker lightmill-image-decoder
asked stop lightmill-server.service
asked 'stop lightmill-worker.service lightmill-worker@*.service'
rmdir /run/systemd/system
for file in /usr/bin/lightmill /usr/lib/lightmill /usr/share/lightmill; do
  if [ -e "$file" ] || [ -L "$file" ]; then
    fail "$file is still there"
  fi
done
enabled
for file in server.conf worker.conf; do
  [ -s "/etc/lightmill/$file" ] || fail "$file is gone"
done

echo '== purge: state and its owner stay'
dpkg --purge lightmill lightmill-server lightmill-worker lightmill-image-decoder
[ -s "$state/lightmill.sqlite" ] || fail 'the state is gone'
[ "$(stat -c %U "$state")" = lightmill ] || fail "the state has lost its owner"
! getent passwd lightmill-worker >/dev/null || fail 'the user lightmill-worker remains'
rm -r "$state"
files >/tmp/after
diff /tmp/before /tmp/after || fail 'these files differ from before'

echo '== again, with the worker removed first: everything of the coordinator stays'
dpkg -i "$server" "$worker" "$client" "$decoder"
systemctl enable lightmill-server lightmill-worker lightmill-worker@a
dpkg --purge lightmill-worker
enabled lightmill-server.service
[ -s /etc/lightmill/server.conf ] || fail 'server.conf is gone'
lightmill-server --version

echo '== then the rest, without state: nothing stays'
dpkg --purge lightmill lightmill-server lightmill-image-decoder
same_as_before
