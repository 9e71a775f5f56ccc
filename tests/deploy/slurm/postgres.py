"""A PostgreSQL server that a cluster's nodes reach at its controller."""
import pathlib
import shutil

from cluster import CONTROLLER, NETWORK, run, wait_until

AS_POSTGRES = ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups", "--pdeathsig=KILL", "--"]


def start_postgres(cluster):
    """The URL of an empty database. The server ends with the cluster."""
    programs = max(pathlib.Path("/usr/lib/postgresql").glob("*/bin"))
    folder = cluster.folder / "postgres"
    folder.mkdir(mode=0o700)
    shutil.chown(folder, "postgres", "postgres")
    cluster.folder.chmod(0o711)  # lets the server reach its folder
    data = folder / "data"
    run(*AS_POSTGRES, programs / "initdb", "-D", data, "-U", "lightmill", "-A", "trust", "-E", "UTF8", "--no-locale", "--no-sync")
    with open(data / "pg_hba.conf", "a", encoding="utf-8") as rules:
        rules.write(f"host all lightmill {NETWORK}.0/24 trust\n")
    # These tests do not cover a crash of the machine, and its guarantee is slow. Shared memory in files of the data folder goes with
    # it, also after a kill.
    cluster.spawn(CONTROLLER, *AS_POSTGRES, programs / "postgres", "-D", data, "-c", f"listen_addresses={NETWORK}.1", "-c",
                  f"unix_socket_directories={folder}", "-c", "fsync=off", "-c", "dynamic_shared_memory_type=mmap",
                  output=cluster.folder / "postgres.log")
    ready = ["psql", "-h", folder, "-U", "lightmill", "-d", "postgres", "-Atc"]
    wait_until("PostgreSQL answers", lambda: run(*ready, "SELECT 1", check=False).strip() == "1")
    run(*ready, "CREATE DATABASE farm")
    return f"postgres://lightmill@{CONTROLLER}/farm"
