#!/bin/sh
# From a clean clone to a picture: installs packages, builds, starts a
# farm on this machine and renders the Cornell box.
#
#   ./quickstart.sh          in a terminal: leaves the farm running, and prints how to
#                            use and stop it
#   ./quickstart.sh --once   stops the farm when the picture is done, unless it was
#                            running before. The default without a terminal
#   ./quickstart.sh --stop   stops the farm
set -eu
cd "$(dirname "$0")"
. deploy/environment.sh
. deploy/lock.sh

data=.lightmill
run=$data/quickstart
bin=build/release/bin
ninja=build/quickstart.ninja # its process, while it runs

# alive NAME: whether the process recorded under this name is still that program of this clone.
alive() {
  pid=$(cat "$run/$1.pid" 2>/dev/null) || return 1
  exe=$(readlink "/proc/$pid/exe" 2>/dev/null) || return 1
  [ "${exe% (deleted)}" = "$(pwd -P)/$bin/lightmill-$1" ]
}

# outdated NAME: whether it is alive, and a build has replaced its program.
outdated() {
  alive "$1" && [ "${exe% (deleted)}" != "$exe" ]
}

# stop NAME: sends SIGTERM and waits. Sends SIGKILL after ten seconds.
stop() {
  if alive "$1"; then
    kill "$pid"
    tries=0
    while alive "$1"; do
      tries=$((tries + 1))
      [ "$tries" -le 100 ] || kill -9 "$pid" 2>/dev/null || break
      sleep 0.1
    done
  fi
  rm -f "$run/$1.pid"
}

stop_farm() {
  stop worker
  stop server
}

# start NAME ARGUMENTS...: runs lightmill-NAME in the background. It has a session of its own, so a Ctrl-C does not stop it.
start() {
  name=$1
  shift
  setsid "$bin/lightmill-$name" "$@" >>"$run/$name.log" 2>&1 </dev/null &
  echo $! >"$run/$name.pid"
}

# wait_for_server: waits until the coordinator has written its ports. Fails if it has ended, or after a minute.
wait_for_server() {
  tries=0
  while [ ! -s "$run/port" ] || [ ! -s "$run/http" ]; do
    tries=$((tries + 1))
    if [ "$tries" -gt 1200 ] || ! kill -0 "$(cat "$run/server.pid")" 2>/dev/null; then
      return 1
    fi
    sleep 0.05
  done
}

# start_server: starts the coordinator on the default ports, or on free ones if they are in use.
start_server() {
  rm -f "$run/port" "$run/http"
  start server --data "$data" --listen 127.0.0.1:7350 --port-file "$run/port" \
    --http 127.0.0.1:7380 --http-port-file "$run/http"
  started_server=yes
  wait_for_server && return
  if tail -n 3 "$run/server.log" | grep -q 'using the port'; then
    echo 'Port 7350 or 7380 is in use. The farm listens on free ports instead.'
    stop server
    start server --data "$data" --listen 127.0.0.1:0 --port-file "$run/port" \
      --http 127.0.0.1:0 --http-port-file "$run/http"
    wait_for_server && return
  fi
  echo "the coordinator did not start. The last lines of $run/server.log:" >&2
  tail -n 5 "$run/server.log" >&2
  stop server
  exit 1
}

# start_farm: starts the coordinator and the worker, if they are not running. Restarts them after a build of their programs.
start_farm() {
  restarted=no
  if outdated server || outdated worker; then
    echo 'The running farm of this clone is older than its programs. It is restarted, and resumes its jobs.'
    stop_farm
    restarted=yes
  fi
  if alive server && [ -s "$run/port" ] && [ -s "$run/http" ]; then
    echo "using the running farm of this clone, on port $(cat "$run/port")"
  else
    stop_farm # its worker would look for the ended coordinator
    start_server
  fi
  if ! alive worker; then
    start worker --server "127.0.0.1:$(cat "$run/port")"
    started_worker=yes
  fi
  if [ "$restarted" = yes ]; then # the farm was running before, so --once does not stop it
    started_server=no
    started_worker=no
  fi
}

# wait_for_worker: waits until the farm has a worker. Fails if the worker or the coordinator has ended, or after a minute.
wait_for_worker() {
  tries=0
  until "$bin/lightmill" workers --server "$farm" --json | grep -q '"name"'; do
    tries=$((tries + 1))
    for program in server worker; do
      if [ "$tries" -gt 300 ] || ! kill -0 "$(cat "$run/$program.pid")" 2>/dev/null; then
        echo "the farm has no worker. The last lines of $run/$program.log:" >&2
        tail -n 5 "$run/$program.log" >&2
        failed=yes
      fi
    done
    [ "$failed" = no ] || exit 1
    sleep 0.2
  done
}

# stop_started: stops only what this run has started.
stop_started() {
  [ "$started_worker" = no ] || stop worker
  [ "$started_server" = no ] || stop server
}

# interrupted: what an interrupt does. The farm has a session of its own, so it stays.
interrupted() {
  trap '' INT TERM HUP
  printf '\ninterrupted\n'
  [ ! -e "$ninja" ] || kill "$(cat "$ninja")" 2>/dev/null || :
  if [ "$once" = no ] && alive server; then
    echo "The farm keeps running. ./quickstart.sh --stop stops it. The program lightmill is in $bin."
  fi
  exit 130
}

started_server=no
started_worker=no
failed=no
once=no
[ -t 1 ] || once=yes
case "$*" in
  '') ;;
  --once) once=yes ;;
  --stop)
    if ! alive server && ! alive worker; then
      echo 'No farm of this clone is running.'
      exit 0
    fi
    stop_farm
    echo 'The farm is stopped.'
    exit 0
    ;;
  -h | --help)
    sed -n '2,9s/^# \{0,1\}//p' "$0"
    exit 0
    ;;
  *)
    echo "quickstart.sh: unknown argument: $*" >&2
    sed -n '2,9s/^# \{0,1\}//p' "$0" >&2
    exit 2
    ;;
esac

# phase NAME: prints the time of the last phase, and begins this one.
phase() {
  now=$(date +%s)
  [ -z "$phase" ] || echo "$phase: $((now - phase_began)) s"
  [ -z "$1" ] || echo "$1 ..."
  phase=$1
  phase_began=$now
}

# fail_build WHAT: shows the end of the log, and ends.
fail_build() {
  tail -n 30 "$log" >&2
  echo "$1: see $log" >&2
  exit 1
}

# show_progress: copies ninja's output to the log, and shows the progress: in a terminal in one line, else four times. Prints when
# the page is ready, which is built beside the programs.
show_progress() {
  shown=0
  while IFS= read -r line; do
    printf '%s\n' "$line" >>"$log"
    case "$line" in '['[1-9]*/[1-9]*'] '*) ;; *) continue ;; esac
    step=${line#[}
    step=${step%%]*}
    case "$line" in
      *" Building the documents' pages")
        [ ! -t 1 ] || printf '\r\033[K'
        echo "page: ready $(($(date +%s) - phase_began)) s after the start of the build"
        ;;
    esac
    if [ -t 1 ]; then
      printf '\r\033[Kbuild: %s of %s, %s s (details: %s)' "${step%/*}" "${step#*/}" $(($(date +%s) - phase_began)) "$log"
    elif [ $((${step%/*} * 4 / ${step#*/})) -gt "$shown" ]; then
      shown=$((${step%/*} * 4 / ${step#*/}))
      echo "build: ${step%/*} of ${step#*/}"
    fi
  done
  [ ! -t 1 ] || printf '\r\033[K'
}

# build TARGET...: builds all targets it can. Fails if one of them failed.
build() {
  rm -f build/quickstart.failed
  # In the background, because a shell handles a signal only after its command.
  {
    # shellcheck disable=SC2016  # the variables of the inner shell
    NINJA_STATUS='[%f/%t] ' sh -c 'echo $$ >"$0" && exec ninja "$@"' "$ninja" -j "$compilers" -k 0 -C build/release "$@" 2>&1 ||
      : >build/quickstart.failed
  } | show_progress &
  wait $!
  rm -f "$ninja"
  [ ! -e build/quickstart.failed ]
}

lock_builds || exit 1
trap interrupted INT TERM HUP
log=build/quickstart.log
: >"$log"
phase=
phase 'packages, download'
deploy/setup --download >>"$log" 2>&1 || fail_build 'the packages could not be fetched'
phase 'packages, installation'
deploy/setup >>"$log" 2>&1 || fail_build 'the packages could not be installed'
phase build
# In a copied clone, the build folder still names the original clone.
configured_for=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' build/release/CMakeCache.txt 2>/dev/null) || :
if [ ! -e build/release/build.ninja ] || [ "$(cd "${configured_for:-/}" 2>/dev/null && pwd -P)" != "$(pwd -P)" ]; then
  rm -f build/release/CMakeCache.txt
  cmake --preset release -DLIGHTMILL_TESTS=OFF >>"$log" 2>&1 || fail_build 'the build could not be configured'
fi
compilers=$(python3 -B tests/runner/compilers.py)
programs='lightmill lightmill-server lightmill-worker'
# The page is built beside the programs. Without npm there is no such target.
# shellcheck disable=SC2086  # one word per program
if ! build $programs lightmill-web; then
  build $programs || fail_build 'the build failed'
  grep -m 1 -A 5 '^FAILED:.*web' "$log" >&2 || :
  echo "The web page was not built, and the farm starts without it. The reason is in $log."
fi
unlock_builds
phase farm

mkdir -p "$run"
[ "$once" = no ] || trap stop_started EXIT
start_farm
farm=127.0.0.1:$(cat "$run/port")
wait_for_worker
phase picture

"$bin/lightmill" render scenes/cornell-bench-blocks.json --server "$farm" --spp 128 -o cornell-box.exr -o cornell-box.png
phase ''
echo
echo 'Pictures: cornell-box.png (8 bits) and cornell-box.exr (linear floats)'
if [ "$once" = yes ]; then
  if [ "$started_server" = yes ]; then
    echo 'The farm is stopped.'
  else
    echo 'The farm keeps running. ./quickstart.sh --stop stops it.'
  fi
  exit 0
fi

client="$bin/lightmill"
[ "$farm" = 127.0.0.1:7350 ] || client="LIGHTMILL_SERVER=$farm $client"
cat <<END

The farm is running (data in $data, logs in $run). Watch it in a browser at

  http://127.0.0.1:$(cat "$run/http")/

or try:

  $client render \\
    scenes/cornell-bench-balls.json -o balls.png
  $client jobs
  $client workers
  $client --help

Stop it with ./quickstart.sh --stop. After a restart it resumes its jobs.
END
