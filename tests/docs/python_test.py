# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the recipes of docs/python.md in order: they print the lines that the page shows. Without matplotlib the plot is left out,
without Bullet the world.

usage: python_test.py FOLDER_OF_THE_PACKAGE
"""
import contextlib
import io
import os
import re
import sys
import tempfile
from pathlib import Path

from printed import agrees

ROOT = Path(__file__).resolve().parents[2]


def main():
    sys.path.insert(0, sys.argv[1])
    try:
        import vps
        vps._baker("the page")
    except ImportError as error:
        print(f"needs Debian's python3-numpy, and the baker's module: {error}")
        return 77
    try:
        import matplotlib  # noqa: F401
        can_plot = True
    except ImportError:
        can_plot = False
    has_bullet = any(Path(sys.argv[1], "vps").glob("_bullet.*.so"))
    blocks = re.findall(r"^```(python|text)\n(.*?)^```", (ROOT / "docs/python.md").read_text(), flags=re.M | re.S)
    assert len(blocks) >= 8, "the page has lost its recipes"
    names, printed = {}, ""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        os.symlink(ROOT / "sample_meshes", "sample_meshes")
        for kind, text in blocks:
            if "vps.World" in text and not has_bullet:
                break
            if kind == "text":
                assert agrees(text, printed), f"printed\n{printed}\nnot\n{text}"
            elif can_plot or "matplotlib" not in text:
                with contextlib.redirect_stdout(io.StringIO()) as out:
                    exec(compile(text, "docs/python.md", "exec"), names)
                printed = out.getvalue()
        assert not can_plot or Path("clearance.png").stat().st_size > 0
    found = names["clearance"]
    assert 80e-6 < found["in the middle"].distance.min() < 110e-6, "the peg fits with 0.1 mm"
    assert names["off"].sum() > 5 and names["grasps"].sum() > 20
    return 0


if __name__ == "__main__":
    sys.exit(main())
