#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks and bakes every mesh of a corpus, and writes one table of what became of each. See `make corpus`."""
import argparse
import json
import os
import re
import sys
import tempfile

from measured_run import measured_run

FOLDERS = ("meshes", "scenes")
SUFFIXES = (".obj", ".ply", ".stl", ".off", ".gltf", ".glb", ".dae", ".3ds", ".fbx")
RESOLUTION = "200"
TIMEOUT_S = 300

HEADER = """\
# What becomes of a corpus of meshes

Each mesh is baked as it is, at 200 voxels along its longest side, with the default contents: field `scaled`, pointshell, tree.
`make corpus` writes this page; [decisions.md](decisions.md) has the test that decides which holes are filled. A mesh that is
refused has a second row with `--repair fill` or, if that is refused too, with `--repair wrap`. Lengths are in millimetres where
`vpsbake check` takes the numbers for millimetres, else in metres. "Thin": the wall there is thinner than two voxels. Time is that of
the whole command, import and write included, on a machine under other load. Errors of the field, from the certificate's samples,
and the covering radius of the pointshell are in voxels. Memory is resident, of the largest process.
"""
COLUMNS = ("file", "triangles", "verdict", "repair", "notes", "time, s", "asset, MB", "error, max", "error, 99 %",
           "covering", "memory, MB")


def meshes_in(shared):
    """Paths relative to `shared`, in the same order on every machine."""
    found = []
    for folder in FOLDERS:
        top = os.path.join(shared, folder)
        if not os.path.isdir(top):
            print(f"{folder}: no such folder beside this one, skipped", file=sys.stderr)
            continue
        for place, _, names in os.walk(top):
            found += [os.path.relpath(os.path.join(place, name), shared) for name in names
                      if name.lower().endswith(SUFFIXES)]
    return sorted(found)


# Shortens the program's sentences for table cells.
SHORTER = (
    (r" at \([-+.e\d, ]+\) m", ""),
    (r"^the mesh is open: it leaks through (.*), the longest border of (.*)", r"open: \1, longest border \2"),
    (r"^repair \w+: ", ""),
    (r"(\d+ shells?) crossing or touching another or itself \((\d+) pairs of triangles\): united",
     r"\1 united (\2 pairs of triangles cross)"),
    (r"^(\d+ %) of the surface fills holes: .*", r"\1 of the surface fills holes"),
    (r"^the mesh was inside out; its winding was reversed", "was inside out"),
    (r"^turned (\d+) triangles wound against their neighbours", r"turned \1 triangles"),
)


def short(text):
    thin = re.match(r"(\S+) % of the surface has a wall thinner than two voxels", text)
    if thin:
        return f"{float(thin[1]):.3g} % of the surface thin"
    for pattern, replacement in SHORTER:
        text = re.sub(pattern, replacement, text)
    return text


def reason_of(run):
    """A short reason why a command failed."""
    if run.timed_out:
        return f"not done in {TIMEOUT_S} s"
    lines = run.err.strip().splitlines()
    if not lines:
        return f"ended with code {run.code} and not a word"
    # Removes the file's name at the front and the advice at the end.
    return short(re.sub(r"^vpsbake: error: .*?: (?=\S)", "", lines[-1]).rsplit("; ", 1)[0])


class Corpus:
    def __init__(self, vpsbake, shared, work):
        self.vpsbake, self.shared, self.asset = vpsbake, shared, os.path.join(work, "corpus.vps.hdf")

    def check(self, name):
        """The report of `check`, or None if the file cannot be read; and the run."""
        path = os.path.join(self.shared, name)
        run = measured_run([self.vpsbake, "check", "--json", "--resolution", RESOLUTION, path], TIMEOUT_S)
        try:
            return json.loads(run.out), run
        except ValueError:
            return None, run

    def bake(self, name, unit, repair=None):
        command = [self.vpsbake, os.path.join(self.shared, name), "--resolution", RESOLUTION, "--unit", unit, "--json",
                   "-o", self.asset]
        return measured_run(command + (["--repair", repair] if repair else []), TIMEOUT_S)

    def row(self, name, triangles, run, asked):
        count = f"{triangles:,}" if triangles is not None else ""
        cells = {"file": name, "triangles": count, "repair": asked or "", "time, s": f"{run.seconds:.1f}",
                 "memory, MB": f"{run.peak_bytes / 1e6:.0f}"}
        if run.code != 0:
            cells["verdict"] = f"refused: {reason_of(run)}" if run.code in (2, 3) else f"FAILED: {reason_of(run)}"
        else:
            result = json.loads(run.out)
            voxel = result["voxel_size"]
            error = result["certificate"].get("scaled")
            cells |= {"verdict": "bakes", "repair": result["repair"], "notes": "; ".join(map(short, result["notes"])),
                      "asset, MB": f"{result['bytes'] / 1e6:.1f}",
                      "covering": f"{result['pointshell']['covering_radius'] / voxel:.2f}"}
            if error:
                cells |= {"error, max": f"{error['max'] / voxel:.3f}", "error, 99 %": f"{error['p99'] / voxel:.3f}"}
        return cells

    def rows(self, name):
        report, check = self.check(name)
        triangles = report["triangles"] if report else None
        unit = "mm" if report and "mm" in report["likely_unit"] else "m"
        bake = self.bake(name, unit)
        first = self.row(name, triangles, bake, None)
        # Check and bake share their code and must agree. If they do not, the table says so.
        if (check.code == 0) != (bake.code == 0):
            first["notes"] = f"CHECK DISAGREES: {reason_of(check) if check.code else 'usable'}; {first.get('notes', '')}"
        yield first
        if bake.code != 3 or not report:
            return
        for repair in ("fill", "wrap"):
            bake = self.bake(name, unit, repair)
            if bake.code == 0 or repair == "wrap":
                yield self.row(name, triangles, bake, repair)
                return


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vpsbake", required=True)
    parser.add_argument("--shared", required=True, help="folder that holds meshes/ and scenes/")
    parser.add_argument("--work", default=".", help="existing folder for the assets, deleted afterwards")
    parser.add_argument("-o", "--output", required=True, help="Markdown file")
    arguments = parser.parse_args()

    names = meshes_in(arguments.shared)
    if not names:
        print("no meshes: nothing written", file=sys.stderr)
        return
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    counts = {"bakes": 0, "refused": 0, "FAILED": 0}
    with tempfile.TemporaryDirectory(dir=arguments.work) as work:
        corpus = Corpus(arguments.vpsbake, arguments.shared, work)
        for name in names:
            for number, cells in enumerate(corpus.rows(name)):
                if number == 0:
                    counts[cells["verdict"].split(":")[0]] += 1
                print(f"{cells['time, s']:>6} s  {name}: {cells['verdict']}", file=sys.stderr)
                # A bar inside a cell would start a new cell.
                lines.append("| " + " | ".join(cells.get(c, "").replace("|", "\\|") for c in COLUMNS) + " |")
    summary = (f"{len(names)} files: {counts['bakes']} bake, {counts['refused']} are refused, "
               f"{counts['FAILED']} fail otherwise.\n")
    with open(arguments.output, "w", encoding="utf-8") as file:
        file.write("\n".join([HEADER, summary] + lines) + "\n")


if __name__ == "__main__":
    main()
