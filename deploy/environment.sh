# shellcheck shell=sh
# Sourced by the scripts in the root folder. Sets PATH and HOME if the environment was emptied.
PATH=${PATH:-/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin}
case ":$PATH:" in *:/usr/bin:*) ;; *) PATH=$PATH:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin ;; esac
HOME=${HOME:-$(getent passwd "$(id -u)" | cut -d: -f6)}
HOME=${HOME:-/tmp}
export PATH HOME
