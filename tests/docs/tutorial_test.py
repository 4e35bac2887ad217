# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tutorial's commands in order with an installation of this build: they print the lines that the tutorial shows.

usage: tutorial_test.py BUILD
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from printed import agrees

ROOT = Path(__file__).resolve().parents[2]


def run(command, cwd, **environment):
    done = subprocess.run(command, shell=True, cwd=cwd, env=dict(os.environ, **environment), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 0, f"{command}\nended with {done.returncode}:\n{done.stdout}"
    return done.stdout


def main():
    blocks = re.findall(r"^```(sh|text)\n(.*?)^```", (ROOT / "docs/tutorial.md").read_text(), flags=re.M | re.S)
    assert len(blocks) >= 5, "the tutorial has lost its commands"
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        run(f"cmake --install '{Path(sys.argv[1]).resolve()}' --prefix '{work}/prefix'", work)
        shutil.copytree(ROOT / "sample_meshes", work / "sample_meshes")
        shutil.copytree(ROOT / "docs/examples", work / "docs/examples")
        printed = ""
        for kind, text in blocks:
            if kind == "sh":
                printed = run("set -e\n" + text, work, CMAKE_PREFIX_PATH=str(work / "prefix"), VPSBAKE_CACHE="",
                              PATH=f"{work}/prefix/bin:{os.environ['PATH']}")
                continue
            lines = printed.splitlines()
            for line in text.splitlines():
                assert any(agrees(line, other) for other in lines), f"no line like\n{line}\nin what was printed:\n{printed}"
        assert "it lies on the ground" in run("falling_body/falling_body nut.vps.hdf peg.vps.hdf", work)
        assert (work / "fall.html").stat().st_size > 0
        # The robot that docs/scene.md names.
        gripper = work / "docs/examples/gripper"
        printed = run("vpsbake scene gripper.toml && cmake -S . -B build && cmake --build build && "
                      "build/gripper gripper.vps/gripper.vps.json", gripper, CMAKE_PREFIX_PATH=str(work / "prefix"),
                      VPSBAKE_CACHE="", PATH=f"{work}/prefix/bin:{os.environ['PATH']}")
        assert "it was lifted and stands on the table again" in printed, printed
        assert "vps:" not in printed, printed
    return 0


if __name__ == "__main__":
    sys.exit(main())
