"""A Slurm cluster of some nodes on this machine, for tests: own ports, own folder, as any user, without systemd and cgroups."""
import contextlib
import getpass
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch")
CONFIG = """
ClusterName=strobetest
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
CryptoType=crypto/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SchedulerParameters=batch_sched_delay=1,sched_interval=1,sched_min_interval=100000
ReturnToService=2
JobRequeue=1
KillWait=5
SlurmdTimeout=4
SlurmctldTimeout=10
InactiveLimit=0
MinJobAge=10
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/node-%n.pid
SlurmctldLogFile={folder}/controller.log
SlurmdLogFile={folder}/node-%n.log
"""


def path_with_sbin():
    """Returns PATH with the folders of daemons."""
    return os.environ.get("PATH", "") + ":/usr/sbin:/sbin"


def missing_programs():
    """Returns the programs of Slurm that are not installed."""
    return [name for name in PROGRAMS if not shutil.which(name, path=path_with_sbin())]


def free_ports(count):
    """Returns ports that nothing uses now."""
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


def processes(*words):
    """Returns the numbers of the processes with all of these bytes in their environment."""
    found = []
    for number in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open("/proc/%s/environ" % number, "rb") as file:
                environment = file.read()
        except OSError:
            continue
        if int(number) != os.getpid() and all(word.encode() in environment for word in words):
            found.append(int(number))
    return found


def kill(numbers):
    """Kills processes. Those that have ended are left out."""
    for number in numbers:
        with contextlib.suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)


class SlurmCluster:
    """A cluster with the nodes n1, n2, ... of some processors each. A context manager."""

    def __init__(self, nodes=3, processors=1):
        self.folder = tempfile.mkdtemp(prefix="strobe-slurm-", dir="/tmp")  # sockets have short names
        self.nodes = ["n%d" % (i + 1) for i in range(nodes)]
        controller, *ports = free_ports(nodes + 1)
        host = socket.gethostname().split(".")[0]
        text = CONFIG.format(host=host, controller=controller, user=getpass.getuser(), folder=self.folder)
        for node, port in zip(self.nodes, ports):
            text += "NodeName=%s NodeHostname=%s NodeAddr=127.0.0.1 Port=%d CPUs=%d State=UNKNOWN\n" % (node, host, port, processors)
        text += "PartitionName=main Nodes=%s Default=YES MaxTime=INFINITE State=UP\n" % ",".join(self.nodes)
        self.write("slurm.conf", text)
        # SLURM_CONF, with the unique folder, marks all processes of the cluster.
        self.environment = {**os.environ, "PATH": path_with_sbin(), "SLURM_CONF": self.path("slurm.conf")}
        os.makedirs(self.path("state"))
        for node in self.nodes:
            os.makedirs(self.path("spool-" + node))

    def path(self, name):
        """Returns the path of a file of the cluster."""
        return os.path.join(self.folder, name)

    def write(self, name, text):
        """Writes a file of the cluster."""
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        kill(self.processes())
        time.sleep(.1)
        kill(self.processes())
        shutil.rmtree(self.folder, ignore_errors=True)

    def start(self):
        """Starts all daemons, and waits for the nodes."""
        with open(self.path("munge.key"), "wb") as file:
            file.write(os.urandom(128))
        os.chmod(self.path("munge.key"), 0o600)
        self.daemon("munged", "--force", "--key-file", self.path("munge.key"), "--socket", self.path("munge.socket"),
                    "--pid-file", self.path("munge.pid"), "--log-file", self.path("munge.log"), "--seed-file", self.path("munge.seed"))
        self.start_controller("-c")
        for node in self.nodes:
            self.start_node(node)
        self.wait_for_nodes(len(self.nodes))

    def daemon(self, *command, **environment):
        """Starts a daemon, which detaches itself."""
        subprocess.run(command, env={**self.environment, **environment}, check=True, stdin=subprocess.DEVNULL,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=30)

    def start_controller(self, *options):
        """Starts the controller; `-c`: without the saved state."""
        self.daemon("slurmctld", *options, STROBE_TEST_ROLE="controller")

    def start_node(self, node):
        """Starts the daemon of a node."""
        self.daemon("slurmd", "-N", node, STROBE_TEST_ROLE=node)

    def wait_for_nodes(self, count):
        """Waits until this many nodes are idle or have tasks."""
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            states = self.run("sinfo", "-h", "-N", "-o", "%T", check=False).split()
            if sum(state in ("idle", "mixed", "allocated") for state in states) >= count:
                return
            time.sleep(.1)
        raise TimeoutError("the nodes did not start: %s" % states)

    def run(self, *command, check=True, **options):
        """Returns the output of a command in the cluster's environment."""
        done = subprocess.run(command, env=self.environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
                              timeout=120, **options)
        if check and done.returncode:
            raise AssertionError("%s: %s%s" % (" ".join(command), done.stdout, done.stderr))
        return done.stdout

    def processes(self, *words):
        """Returns the processes of the cluster with all of these words in their environment."""
        return processes("SLURM_CONF=" + self.path("slurm.conf"), *words)

    def kill_controller(self):
        """Kills the controller."""
        kill(self.processes("STROBE_TEST_ROLE=controller"))

    def wait_for_saved_state(self):
        """Waits until the controller has written which jobs run, which it does at most every five seconds. A controller that
        starts with an older state starts these jobs again, and takes the nodes that have them already out of service."""
        now, deadline = time.time(), time.monotonic() + 20
        while os.path.getmtime(self.path("state/job_state")) < now and time.monotonic() < deadline:
            time.sleep(.05)

    def kill_node(self, node):
        """Kills the daemon of a node and all its tasks, as a power cut would."""
        for _ in range(3):  # a process may start another one meanwhile
            kill(self.processes("STROBE_TEST_ROLE=" + node) + self.processes("SLURMD_NODENAME=" + node))

    def programs(self, name):
        """Returns the processes of tasks that run a program of this name."""
        found = []
        for number in self.processes("SLURM_JOB_ID="):
            with contextlib.suppress(OSError):
                if os.path.basename(os.readlink("/proc/%d/exe" % number)) == name:
                    found.append(number)
        return found

    @staticmethod
    def variable_of(number, name):
        """Returns an environment variable of a process."""
        with open("/proc/%d/environ" % number, "rb") as file:
            return next(e for e in file.read().decode().split("\0") if e.startswith(name + "="))[len(name) + 1:]

    def job_of(self, number):
        """Returns the task of an array job that runs a process."""
        return "%s_%s" % tuple(self.variable_of(number, "SLURM_ARRAY_%s_ID" % name) for name in ("JOB", "TASK"))

    def node_of(self, number):
        """Returns the node of a process."""
        return self.variable_of(number, "SLURMD_NODENAME")
