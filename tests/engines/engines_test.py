# SPDX-License-Identifier: GPL-3.0-or-later
"""An engine that runs the script of `vpsbake plan --emit` bakes the same bytes as one `vpsbake batch`.

usage: engines_test.py slurm|parallel|snakemake VPSBAKE SAMPLE_MESHES    exit code 77: the engine is not installed
"""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from slurm_cluster import Cluster, missing, wait_until

SKIPPED = 77
TASKS = 4
# These bakes last long enough to be ended while they run. They are in the order of the jobs, as one task may have both.
SLOW = {"icosphere": "0.25mm", "torus": "0.25mm"}


def run(*command, cwd, code=0, environment=None):
    """Runs a command, which must end with this exit code. Returns what it printed."""
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=environment, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False, timeout=300)
    assert done.returncode == code, f"{command} ended with {done.returncode}, not {code}:\n{done.stdout}"
    return done.stdout


def make_meshes(folder, samples):
    """The sample meshes, one of them twice, and settings beside them that make some bakes slow."""
    (folder / "parts").mkdir(parents=True)
    for mesh in samples.glob("*.obj"):
        shutil.copy(mesh, folder if mesh.stem in SLOW else folder / "parts")
    shutil.copy(samples / "gear.obj", folder / "gear_again.obj")
    (folder / "vpsbake.toml").write_text("".join(
        f'[[files]]\nmatch = "{name}.obj"\nvoxel = "{voxel}"\n' for name, voxel in SLOW.items()))


def contents(folder):
    """Assets and the manifest, without the hidden files that record the time of a run."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*")
            if path.is_file() and not path.name.startswith(".")}


def assert_same(left, right):
    names = sorted(set(left) | set(right))
    different = [name for name in names if left.get(name) != right.get(name)]
    assert not different, f"not the same files: {different} of {names}"


def bakes_of(mesh, work):
    """Processes that bake this mesh of the work folder: (number, task of Slurm's array)."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if not entry.name.isdigit() or not os.readlink(entry / "exe").endswith("/vpsbake"):
                continue
            name = (entry / "comm").read_text(encoding="utf-8").strip()
            variables = dict(pair.split("=", 1) for pair in (entry / "environ").read_bytes().decode().split("\0")
                             if "=" in pair)
        except OSError:
            continue  # it has ended
        if name.endswith(mesh) and variables.get("VPS_TEST") == str(work):
            found.append((int(entry.name), variables.get("SLURM_ARRAY_TASK_ID")))
    return found


def plan(engine, work):
    run("vpsbake", "plan", "meshes", "-o", "jobs.jsonl", "--into", "out", "--voxel", "1mm", "--emit", engine,
        "--tasks", TASKS, "--cache", "cache", cwd=work, environment=os.environ)


def play_slurm(work):
    """Cancels one task and kills one bake while they run. Submitted again, the array bakes the missing assets."""
    (work / "meshes/bad.obj").write_text("junk")
    plan("slurm", work)
    killed, cancelled = SLOW
    with Cluster(work / "slurm") as cluster:
        try:
            job = cluster.submit("jobs.sbatch", cwd=work)
            wait_until(lambda: bakes_of(f"{killed}.obj", work), 60, "the bake to kill runs")
            for pid, _ in bakes_of(f"{killed}.obj", work):
                os.kill(pid, signal.SIGKILL)
            wait_until(lambda: bakes_of(f"{cancelled}.obj", work), 60, "the task to cancel runs")
            cluster.ask("scancel", f"{job}_{bakes_of(f'{cancelled}.obj', work)[0][1]}")
            cluster.wait(120)
            assert not bakes_of(".obj", work), "a bake outlives its task"
            for name in SLOW:
                assert not list((work / "out").glob(f"{name}*")), f"{name}: there is an asset or a part of one"
            told = run("vpsbake", "merge", "jobs.jsonl", cwd=work, code=5)
            for name in (*SLOW, "bad"):
                assert name in told, f"merge does not name {name}:\n{told}"
            cluster.submit("jobs.sbatch", cwd=work)
            cluster.wait(120)
        except BaseException:
            cluster.print_logs()
            for output in sorted(work.glob("slurm-*.out")):
                print(f"--- {output.name}", output.read_text(), sep="\n", file=sys.stderr)
            raise
    run("vpsbake", "merge", "jobs.jsonl", cwd=work, code=5)
    run("vpsbake", "batch", "meshes", "-o", "alone", "--voxel", "1mm", "--jobs", "1", cwd=work, code=5)


def play_script(engine, command, work):
    plan(engine, work)
    run(*command, cwd=work)
    run("vpsbake", "batch", "meshes", "-o", "alone", "--voxel", "1mm", "--jobs", "1", cwd=work)


def main():
    engine, vpsbake, samples = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    absent = missing() if engine == "slurm" else [] if shutil.which(engine) else [engine]
    if absent:
        print(f"skipped: {', '.join(absent)} is not installed")
        return SKIPPED
    # On CTest's timeout the program exits normally, so that everything is cleaned up.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with tempfile.TemporaryDirectory(prefix="vps") as folder:
        work = Path(folder)
        os.environ.update(PATH=f"{vpsbake.parent}:{os.environ['PATH']}", VPS_TEST=str(work), HOME=str(work))
        os.environ.pop("VPSBAKE_CACHE", None)
        make_meshes(work / "meshes", samples)
        if engine == "slurm":
            play_slurm(work)
        elif engine == "parallel":
            play_script(engine, ("sh", "jobs.sh"), work)
        else:
            play_script(engine, ("snakemake", "--snakefile", "jobs.smk", "--cores", "2"), work)
        assert_same(contents(work / "out"), contents(work / "alone"))
        print(f"{len(contents(work / 'out'))} files, the same bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
