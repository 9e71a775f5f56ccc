# shellcheck shell=sh
# Sourced by the scripts that build. They use the lock of test.sh (tests/runner/session.py).

# lock_builds: takes the lock of this checkout's build folders, as descriptor 9. Fails if another command has it.
lock_builds() {
  mkdir -p build
  exec 9>>build/test.lock
  if ! flock -w 1 9; then
    echo "Process $(cat build/test.lock) builds or tests in this checkout already. Start again when it has ended." >&2
    return 1
  fi
  echo $$ >build/test.lock
}

# unlock_builds: tests may run from here on.
unlock_builds() {
  exec 9>&-
}
