# SPDX-License-Identifier: GPL-3.0-or-later
"""A Slurm cluster of one machine, for tests: munged, slurmctld and slurmd with temporary keys, ports and folders."""
import ctypes
import getpass
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

DAEMONS = ("munged", "slurmctld", "slurmd")
CLIENTS = ("sbatch", "scancel", "scontrol", "sinfo", "squeue")
LIBC = ctypes.CDLL(None)
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36  # linux/prctl.h


def search_path():
    """PATH with Debian's folder of daemons, which ordinary users' PATH lacks."""
    return os.environ.get("PATH", "") + ":/usr/sbin"


def missing():
    """Names of the programs that Slurm needs but this machine lacks."""
    return [name for name in DAEMONS + CLIENTS if shutil.which(name, path=search_path()) is None]


def free_ports(count):
    """TCP ports of 127.0.0.1 that are free now."""
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def wait_until(condition, seconds, what):
    """Calls `condition` until it is true. Raises an exception if it is not true within `seconds`."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not within {seconds} s")
        time.sleep(0.1)


def end_with_parent():
    """Makes a daemon end with the test, even if the test is killed."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def end_children():
    """Kills and reaps processes that daemons have left, which this process inherits (a job's slurmstepd detaches itself)."""
    children = Path(f"/proc/self/task/{os.getpid()}/children")
    while left := children.read_text().split():
        for pid in map(int, left):
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


class Cluster:
    """`with Cluster(folder) as cluster:` the node is idle when the block starts, and nothing runs after the block.

    folder: an empty folder with a short path, as it holds sockets (Linux allows 107 characters).
    """

    def __init__(self, folder):
        LIBC.prctl(PR_SET_CHILD_SUBREAPER, 1)
        self.folder = Path(folder).resolve()
        self.processes = []
        self.environment = dict(os.environ, PATH=search_path(), SLURM_CONF=str(self.folder / "slurm.conf"))

    def __enter__(self):
        try:
            self._configure()
            self._start_munge()
            self._start("slurmctld", "-D")
            self._start("slurmd", "-D", "-N", "node")
            wait_until(lambda: self.ask("sinfo", "-h", "-o", "%T").strip() == "idle", 30, "the node is idle")
        except BaseException:
            self.print_logs()
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, *_):
        if len(self.processes) > 1:
            subprocess.run(["scancel", "--quiet", "--user", getpass.getuser()], env=self.environment, check=False,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=20)
            try:
                wait_until(lambda: not self.queue(), 10, "no job is left")
            except (TimeoutError, subprocess.SubprocessError):
                pass  # remaining processes are ended below
        # One after the other, as slurmctld requests a credential from munged when it ends.
        for process in reversed(self.processes):
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.processes = []
        end_children()

    def ask(self, *command):
        """The output of one of Slurm's programs; nothing if it fails."""
        return subprocess.run(command, env=self.environment, check=False, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True, timeout=30).stdout

    def submit(self, *arguments, cwd):
        """sbatch --parsable with these arguments. Returns the job's number."""
        done = subprocess.run(["sbatch", "--parsable", *map(str, arguments)], env=self.environment, cwd=cwd, check=True,
                              stdout=subprocess.PIPE, text=True, timeout=30)
        return done.stdout.strip().split(";")[0]

    def queue(self):
        """Jobs that have not ended, a line each: "12_3 RUNNING"."""
        return self.ask("squeue", "-h", "-r", "-o", "%i %T").splitlines()

    def wait(self, seconds):
        """Waits until every job has ended."""
        wait_until(lambda: not self.queue(), seconds, "every job has ended")

    def print_logs(self):
        """The last lines of each daemon's log, to stderr."""
        for log in sorted(self.folder.glob("*.log")):
            print(f"--- {log.name}", *log.read_text(errors="replace").splitlines()[-30:], sep="\n", file=sys.stderr)

    def _configure(self):
        for name in ("state", "spool"):
            (self.folder / name).mkdir(parents=True)
        controller, node = free_ports(2)
        host = socket.gethostname().split(".")[0]
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20
        # No cgroups, which containers and virtual machines may lack, no accounting, and immediate scheduling.
        (self.folder / "slurm.conf").write_text(f"""\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser={getpass.getuser()}
SlurmdUser={getpass.getuser()}
SlurmctldPort={controller}
SlurmdPort={node}
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobCompType=jobcomp/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=batch_sched_delay=0,sched_min_interval=100000
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
SlurmctldLogFile={self.folder}/slurmctld.log
SlurmdLogFile={self.folder}/slurmd.log
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=1
DefMemPerCPU=1
NodeName=node NodeHostname={host} NodeAddr=127.0.0.1 Port={node} CPUs={os.cpu_count()} RealMemory={memory} State=UNKNOWN
PartitionName=all Nodes=node Default=YES MaxTime=INFINITE State=UP
""")

    def _start_munge(self):
        key = self.folder / "munge.key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(128))
        path = self.folder / "munge.socket"
        self._start("munged", "--foreground", "--force", f"--socket={path}", f"--key-file={key}",
                    f"--pid-file={self.folder}/munged.pid", f"--seed-file={self.folder}/munged.seed",
                    f"--log-file={self.folder}/munged.log")
        wait_until(path.exists, 10, "munged listens")

    def _start(self, name, *arguments):
        with open(self.folder / f"{name}_output.log", "wb") as log:
            self.processes.append(subprocess.Popen(
                [name, *arguments], env=self.environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                start_new_session=True, cwd=self.folder, preexec_fn=end_with_parent))
