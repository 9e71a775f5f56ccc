# shellcheck shell=sh
# Sourced by the scripts that make a fresh Debian, in the root of the checkout.
# shellcheck source=deploy/environment.sh
. deploy/environment.sh

# need_root_and PROGRAM...: ends with exit code 77 without these.
need_root_and() {
  for program in "$@"; do
    if [ "$(id -u)" -ne 0 ] || ! command -v "$program" >/dev/null; then
      echo "${0##*/}: needs root and $*" >&2
      exit 77
    fi
  done
}

# make_debian TARGET OPTION...: calls mmdebstrap with this machine's release and apt sources.
make_debian() {
  target=$1
  shift
  # shellcheck source=/dev/null
  suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
    [ ! -e "$file" ] || cat "$file"
  done | mmdebstrap --quiet "$@" "$suite" "$target" -
}

# build_packages FOLDER: the Debian packages of this checkout.
build_packages() {
  [ -e build/release/build.ninja ] || cmake --preset release -DLIGHTMILL_TESTS=OFF
  ninja -j "$(python3 -B tests/runner/compilers.py)" -C build/release lightmill lightmill-server lightmill-worker lightmill-image-decoder \
    lightmill-docs lightmill-web
  (cd build/release && cpack -G DEB -B "$1/cpack")
  mv "$1"/cpack/lightmill*.deb "$1"
  rm -r "$1/cpack"
}
