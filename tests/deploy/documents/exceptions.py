"""Exceptions of single commands, for the test of the documents' commands. A pattern has the wildcards of shells. Each entry must
match a command, so the test fails for an entry whose command is gone.
"""

# (document, command, why it is not run)
SKIPPED = [
    ("README.md", "./quickstart.sh*", "installs packages and builds"),
    ("README.md", "build/release/bin/lightmill *", "the reader's programs are on its PATH"),
    ("docs/guide/*", "lightmill render scene.blend*", "needs Blender"),
    ("docs/operate/backup.md", "systemctl *", "needs a machine that systemd has started"),
    ("docs/operate/backup.md", "cp -a *", "the folder of an installed service"),
    ("docs/operate/backup.md", "mv /var/lib/lightmill *", "the folder of an installed service"),
    ("docs/operate/backup.md", "chown *", "the folder of an installed service"),
    ("docs/operate/backup.md", "lightmill-server check --store *", "needs a database; failover_tests restores a dump"),
    ("docs/operate/backup.md", "pg_*", "needs a database; failover_tests restores a dump"),
    ("docs/operate/backup.md", "runuser *", "the folder of an installed service"),
    ("docs/operate/cluster.md", "./quickstart.sh*", "stops the farm of this checkout"),
    ("docs/operate/cluster.md", "cmake *", "builds"),
    ("docs/operate/cluster.md", "(cd build/release && cpack)", "builds packages; deploy.package does"),
    ("docs/operate/cluster.md", "sudo *", "changes the machine; deploy.package installs the packages"),
    ("docs/operate/cluster.md", "scp *", "needs another machine"),
    ("docs/operate/compose.md", "*docker compose *", "needs Docker"),
    ("docs/operate/compose.md", "sudo chown *", "users of containers"),
    ("docs/operate/compose.md", "s[sc]* SECOND*", "needs another machine"),
    ("docs/operate/install.md", "./quickstart.sh*", "installs packages and builds"),
    ("docs/operate/install.md", "cmake *", "builds"),
    ("docs/operate/install.md", "(cd build/release && cpack)*", "builds packages; deploy.package does"),
    ("docs/operate/install.md", "systemctl *", "needs a machine that systemd has started"),
    ("docs/operate/install.md", "journalctl *", "needs a machine that systemd has started"),
    ("docs/operate/install.md", "install *", "users of packages"),
    ("docs/operate/kubernetes.md", "*build/image*", "builds images; deploy.container does"),
    ("docs/operate/kubernetes.md", "kubectl *", "needs a cluster; deploy.manifests checks the files"),
    ("docs/operate/monitoring.md", "kubectl *", "needs a cluster"),
    ("docs/operate/running.md", "create*", "needs a database's administrator"),
    ("docs/operate/running.md", "lightmill-server --store *", "needs a database; failover_tests has two coordinators"),
    ("docs/operate/slurm.md", "sbatch *", "needs Slurm; deploy.slurm submits the scripts"),
    ("docs/operate/slurm.md", "deploy/slurm/autoscale *", "needs Slurm; deploy.slurm runs it"),
    ("docs/operate/slurm.md", "s[qc]*", "needs Slurm; deploy.slurm drains workers"),
    ("docs/operate/upgrade.md", "systemctl *", "needs a machine that systemd has started"),
    ("docs/operate/upgrade.md", "cp -a /var/lib/lightmill *", "the folder of an installed service"),
    ("docs/operate/upgrade.md", "apt install *", "needs a package of the next version"),
    ("docs/operate/upgrade.md", "journalctl *", "needs a machine that systemd has started"),
    ("docs/operate/upgrade.md", "mv lightmill.sqlite.format-14*", "needs a migrated store; store_tests migrate one"),
    ("docs/operate/upgrade.md", "rm *lightmill.sqlite*", "needs a migrated store"),
]

# (document, command, the commands that its reader has typed before it, one per line). `jobs_up_to N` submits jobs until the
# last has number N.
BEFORE = [
    ("README.md", "lightmill submit *", "jobs_up_to 6 --spp 1"),
    ("README.md", "lightmill-worker --server *", "cp certs/ca.pem ."),
    ("docs/guide/browser.md", "lightmill-server *--tls-cert*", "lightmill certs init certs\nlightmill certs server certs FARM"),
    ("docs/guide/lab.md", "lightmill show *", "jobs_up_to 1 --spp 1"),
    ("docs/guide/render.md", "lightmill submit *", "jobs_up_to 6 --spp 1"),
    ("docs/guide/render.md", "lightmill pause *", "jobs_up_to 9 --spp 1000000 --priority -1"),
    ("docs/guide/verify.md", "lightmill verify *", "lightmill render scene.json -o picture.exr"),
    ("docs/guide/verify.md", "lightmill show *", "jobs_up_to 1 --spp 1"),
    ("docs/operate/backup.md", "lightmill-server check *", "jobs_up_to 1 --spp 1"),
    ("docs/operate/cluster.md", "export *", "lightmill-server --tls-cert certs/server.pem --tls-ca certs/ca.pem"),
    ("docs/operate/cluster.md", "lightmill workers",
     "lightmill-worker --server FARM:7350 --tls-ca certs/ca.pem --enrol-file certs/render.enrol"),
    ("docs/operate/compose.md", "export *", "lightmill-server --tls-cert certs/server.pem --tls-ca certs/ca.pem"),
    ("docs/operate/compose.md", "lightmill render *",
     "lightmill-worker --server localhost:7350 --tls-ca certs/ca.pem --enrol-file certs/worker.enrol"),
    ("docs/operate/compose.md", "lightmill certs init *", "mkdir -p ~/../deploy/compose && cd ~/../deploy/compose && rm -rf certs"),
    ("docs/operate/compose.md", "lightmill tokens create worker *FARM*",
     "lightmill-server --tls-cert certs/server.pem --tls-ca certs/ca.pem"),
    ("docs/operate/kubernetes.md", "export *", "lightmill-server --tls-cert certs/server.pem --tls-ca certs/ca.pem"),
    ("docs/operate/security.md", "lightmill-worker --server *", "cp farm-certs/ca.pem farm-certs/ada.pem ."),
    ("docs/operate/security.md", "lightmill tokens create render*10 --out render.enrol *admin*", "rm render.enrol"),
    ("docs/operate/slurm.md", "farm=*", "mkdir SAFE-PLACE"),
    ("docs/operate/slurm.md", "lightmill tokens *", "lightmill-server --tls-cert $farm/server.pem --tls-ca $farm/ca.pem"),
    ("docs/operate/slurm.md", "lightmill watch *",
     "lightmill-worker --server NODE:7350 --tls-ca $farm/ca.pem --enrol-file $farm/worker.enrol"),
]

# (document, word, the text by which its reader replaces it)
WORDS = [
    ("docs/*", "JOB", "$(lightmill jobs --json | first id)"),
    ("docs/*", "DIR", "~/.local/share/lightmill"),
    ("docs/guide/*", "Front", "c"),
    ("docs/guide/*", "-o box.png", "--size 32x32 -o box.png"),
    ("docs/guide/*", "-o model.png", "--size 32x32 -o model.png"),
    ("docs/guide/render.md", "--spp 1024", "--spp 1000000"),  # the small picture would end before the next command
    ("docs/guide/scenes.md", "--camera view.json", "--size 32x32 --camera view.json"),
    ("docs/*", "NAME", "$(lightmill workers --json | first name)"),
    ("docs/operate/monitoring.md", "…", ""),
    ("docs/operate/security.md", "…", "--server farm.example:7350 --tls-ca ca.pem"),
    ("docs/operate/security.md", "3f2a9c01b7de", "$(lightmill tokens --json | first id)"),
    ("docs/operate/security.md", "ID", "$(lightmill tokens --json | first id)"),
]

# Names of machines in the documents. Here they are all this machine.
MACHINES = ["FARM", "farm.example", "NODE"]
