"""A Slurm cluster of several nodes on this machine, each node in its own network namespace. Needs root.

A requeued job waits for as long as Slurm's credentials are valid (cred_expire), here 20 s instead of 120."""
import atexit
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from waiting import wait_until

CONTROLLER = "ctl"
NETWORK = "10.77.0"
KILL_WAIT = 600  # seconds that a cancelled job has, longer than tests wait
SLURM_CONF = """
ClusterName=lightmill
SlurmctldHost={controller}({network}.1)
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket,cred_expire=20
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
SlurmdTimeout={silence}
KillWait={kill_wait}
MinJobAge=86400
{nodes}
PartitionName=render Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def run(*command, check=True, **more):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, **more)
    if check and done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def kill_all_in(namespace):
    def alive():
        return [int(pid) for pid in run("ip", "netns", "pids", namespace).split()]

    def killed():
        for pid in alive():
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        return not alive()
    wait_until(f"nothing runs in {namespace}", killed)


def remove_leftovers():
    """Removes the remains of clusters whose processes were killed."""
    for line in run("ip", "netns", "list").splitlines():
        found = re.match(r"lmslurm(\d+)-\w+", line)
        if found and not pathlib.Path(f"/proc/{found[1]}").exists():
            kill_all_in(found[0])
            run("ip", "netns", "delete", found[0])
            shutil.rmtree(pathlib.Path("/etc/netns") / found[0], ignore_errors=True)


class Cluster:
    """Nodes n1, n2, ... with one CPU each, and a controller ctl. Slurm gives up a node after this many seconds of silence."""

    def __init__(self, folder, nodes, silence=5):
        self.folder = pathlib.Path(folder)
        self.nodes = [f"n{i + 1}" for i in range(nodes)]
        self.hosts = {CONTROLLER: f"{NETWORK}.1", **{node: f"{NETWORK}.{11 + i}" for i, node in enumerate(self.nodes)}}
        self.silence = silence
        self.made = []  # namespaces
        self.files = []  # below /etc/netns
        self.munged = None
        self.processes = []
        self.environment = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf")}

    def __enter__(self):
        atexit.register(self.__exit__)
        self.start()
        return self

    def __exit__(self, *_):
        for host in self.made:
            kill_all_in(self.namespace(host))
        if self.munged:
            self.munged.kill()
            self.munged.wait()
        for process in self.processes:
            process.wait()
        for host in self.made:
            run("ip", "netns", "delete", self.namespace(host), check=False)
        for path in self.files:
            path.unlink(missing_ok=True)
            path.parent.rmdir()
        self.made, self.files, self.processes, self.munged = [], [], [], None

    @staticmethod
    def namespace(host):
        return f"lmslurm{os.getpid()}-{host}"

    def start(self):
        remove_leftovers()
        for name in ("munge", "state", *(f"spool-{node}" for node in self.nodes)):
            (self.folder / name).mkdir(mode=0o700)
        nodes = "\n".join(f"NodeName={node} NodeAddr={self.hosts[node]} CPUs=1 State=UNKNOWN" for node in self.nodes)
        (self.folder / "slurm.conf").write_text(SLURM_CONF.format(controller=CONTROLLER, network=NETWORK, folder=self.folder,
                                                                  silence=self.silence, kill_wait=KILL_WAIT, nodes=nodes))
        self.connect()
        self.start_munge()
        self.spawn(CONTROLLER, "slurmctld", "-D", "-i")
        for node in self.nodes:
            self.start_node(node)
        wait_until("all nodes are idle", lambda: set(self.states().values()) == {"idle"})

    def connect(self):
        """A namespace for each host. The bridge between them is the controller's."""
        hosts = "127.0.0.1 localhost\n" + "".join(f"{address} {host}\n" for host, address in self.hosts.items())
        for host in self.hosts:
            run("ip", "netns", "add", self.namespace(host))
            self.made.append(host)
            path = pathlib.Path("/etc/netns") / self.namespace(host) / "hosts"
            path.parent.mkdir(parents=True)
            self.files.append(path)
            path.write_text(hosts)
            self.ip(host, "link", "set", "lo", "up")
        self.ip(CONTROLLER, "link", "add", "bridge", "type", "bridge")
        self.ip(CONTROLLER, "address", "add", f"{self.hosts[CONTROLLER]}/24", "dev", "bridge")
        self.ip(CONTROLLER, "link", "set", "bridge", "up")
        for node in self.nodes:
            self.ip(CONTROLLER, "link", "add", node, "type", "veth", "peer", "name", "eth0", "netns", self.namespace(node))
            self.ip(CONTROLLER, "link", "set", node, "master", "bridge", "up")
            self.ip(node, "address", "add", f"{self.hosts[node]}/24", "dev", "eth0")
            self.ip(node, "link", "set", "eth0", "up")

    def start_munge(self):
        """A daemon for this cluster only, with its own key: all hosts share the files of this machine."""
        key = self.folder / "munge" / "key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        socket = self.folder / "munge" / "socket"
        self.munged = subprocess.Popen(
            ["munged", "--foreground", "--force", f"--key-file={key}", f"--socket={socket}",
             f"--pid-file={self.folder}/munge/pid", f"--seed-file={self.folder}/munge/seed", f"--log-file={self.folder}/munge.log"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_until("munged listens", socket.exists)

    def start_node(self, node):
        # slurmd requires control groups although it uses none, and `ip netns exec` hides them with a /sys of the node's own.
        groups = "mount -t tmpfs none /sys/fs/cgroup && cd /sys/fs/cgroup && mkdir systemd && " \
                 "mount -t cgroup -o none,name=lightmill none systemd && cd /"
        self.spawn(node, "sh", "-c", groups + ' && exec slurmd -D -N "$0"', node)

    # Faults.

    def kill_all_of(self, host):
        """Ends the node like a power failure."""
        kill_all_in(self.namespace(host))

    def set_link(self, node, state):
        self.ip(CONTROLLER, "link", "set", node, state)

    # What runs, and where.

    def ip(self, host, *arguments):
        run("ip", "-n", self.namespace(host), *arguments)

    def at(self, host, *command):
        """The command to run there: with that host's network, name and table of hosts."""
        script = 'hostname "$0" && exec "$@"'
        return ["ip", "netns", "exec", self.namespace(host), "unshare", "--uts", "sh", "-c", script, host, *map(str, command)]

    def spawn(self, host, *command, output=None, environment=None):
        with open(output or self.folder / f"{host}.out", "a", encoding="utf-8") as log:
            process = subprocess.Popen(self.at(host, *command), env={**self.environment, **(environment or {})}, stdout=log,
                                       stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, cwd=self.folder)
        self.processes.append(process)
        return process

    def call(self, *command, host=CONTROLLER, environment=None, check=True):
        """Its output."""
        return run(*self.at(host, *command), check=check, env={**self.environment, **(environment or {})}, cwd=self.folder)

    def states(self):
        """State by node: idle, mixed, allocated, down, ... according to Slurm."""
        listed = self.call("sinfo", "--noheader", "--Node", "--format", "%N %T", check=False)
        return dict(line.split() for line in listed.splitlines())

    def jobs(self, name):
        """Jobs of that name that have not ended: (id, state, node, number of restarts)."""
        listed = self.call("squeue", "--noheader", "--array", "--name", name, "--Format",
                           "JobArrayID:30,State:30,NodeList:30,RestartCnt:10")
        rows = [[line[0:30].strip(), line[30:60].strip(), line[60:90].strip(), int(line[90:].strip())]
                for line in listed.splitlines()]
        return [tuple(row) for row in rows]
