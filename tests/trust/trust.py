#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tries to break everything that the project promises, and writes what was tried and found. See `make trust`.

Exit code 1: something broke; the page says what."""
import argparse
import collections
import json
import os
import random
import re
import struct
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "bench"))
from corpus import meshes_in  # noqa: E402
from measured_run import measured_run  # noqa: E402

HEADER = """\
# What is tried to break the promises

`make trust` searches the worst case of every promise, damages assets and meshes, kills bakes and fills disks, and checks a corpus of
meshes. It wrote this page: all figures come from one run. `TRUST_SECONDS` is the time of each of the four parts that can last as long
as one likes, and `TRUST_FIRST` the first number of their random choices, so that another run tries others.
"""

NOT_COVERED = """\
## What is not covered

- A search finds worst cases, it does not prove that there are none. [bounds.md](bounds.md) has the proofs, and says which bounds are
  measured. Bodies are attacked at one resolution, and pairs are a body and a copy of itself.
- The contacts of the Bullet plug-in are not attacked by climbing: bodies on planes, boxes, hulls and triangle meshes, contacts ahead, kept
  segments. The tests of `tests/runtime/bullet` compare them with full queries, and damaged assets are dropped there, too.
- Distances and sides come from CGAL. The bake repairs meshes with the same library: an error of its predicates would show in neither.
- A bake is killed, but the machine keeps running: what a power failure leaves depends on the file system. Network file systems are not
  tried.
- Only Linux on x86-64 is tried, with little-endian numbers of 64-bit machines.
- Damaged meshes are small, and are damaged in their bytes: what a wrong modelling program writes is in the corpus only.
- Memory is taken to be correct. Data races are sought by ThreadSanitizer in `make test-tsan`, not here: in queries, batches, pairs in
  Bullet, and the exact cuts of crossing shells. The baker's other stages are not tried for races.
"""

# Tests of faults: program of the build, filter.
FAULTS = (("cli/faults_test", "*"), ("formats/formats_test", "Hdf5Writer.AFullDisk*"),
          ("cli/cli_test", "BatchParts.AKilledBatch*"))
RESOLUTION = "64"
LONGEST_S = 300  # of one command


def table(columns, rows):
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


class Trust:
    def __init__(self, arguments, work):
        self.arguments, self.work = arguments, work
        self.vpsbake = os.path.join(arguments.build, "cli", "vpsbake")
        self.pages, self.broken = [], []

    def program(self, *parts):
        return os.path.join(self.arguments.build, "tests", *parts)

    def say(self, text):
        print(f"== {text}", file=sys.stderr)

    def meshes(self):
        samples = os.path.join(ROOT, "sample_meshes")
        found = [os.path.join(samples, name) for name in sorted(os.listdir(samples)) if name.endswith(".obj")]
        if self.arguments.shared:
            found += [os.path.join(self.arguments.shared, name) for name in meshes_in(self.arguments.shared)]
        return found

    # Rounds with other random places, each for all bodies and settings, until the time is over.
    def promises(self):
        attack = self.program("trust", "attack_promises")
        known = [json.loads(line) for line in subprocess.check_output([attack, "--list"], text=True).splitlines()]
        found = {p["name"]: collections.Counter() for p in known}
        worst = {p["name"]: [None, None] for p in known}
        bodies, attacked, starts = set(), set(), self.arguments.starts
        end = time.monotonic() + self.arguments.seconds
        seed = self.arguments.first
        while (left := end - time.monotonic()) > 0:
            self.say(f"the promises, random places {seed}: {left:.0f} s left")
            run = measured_run([attack, *self.meshes(), "--starts", str(starts), "--climbs", "12", "--seed", str(seed + 1),
                                "--seconds", str(left)])
            if run.code not in (0, 1):
                self.broken.append(f"the attack on promises ends with code {run.code}")
                break
            for line in map(json.loads, run.out.splitlines()):
                body = (line["mesh"], line["options"])
                if "found" in line:
                    bodies.add(line["mesh"])
                    attacked.add(body)
                for name, value in line.get("found", {}).items():
                    count = found[name]
                    count["places"] += value["measured"]
                    if worst[name][0] is None or value["worst"] > worst[name][0]:
                        worst[name][0] = value["worst"]
                    if worst[name][1] is None or value["started"] > worst[name][1]:
                        worst[name][1] = value["started"]
                    most = next(p["most"] for p in known if p["name"] == name)
                    count["subjects"] += (name, body) not in count
                    count[name, body] = 1
                    if value["worst"] > most and ("broken", body) not in count:
                        count["broken"] += 1
                        count["broken", body] = 1
            seed += 1
        rows = []
        for promise in known:
            count, name = found[promise["name"]], promise["name"]
            if count["broken"]:
                self.broken.append(f"{name}: on {count['broken']} of {count['subjects']} bodies")
            high, started = ("" if value is None else f"{value:.3f}" for value in worst[name])
            rows.append((name, promise["says"], "certificate" if promise["certified"] else "proof", promise["most"],
                         count["subjects"], f"{count['places']:,}", started, high,
                         f"no: on {count['broken']}" if count["broken"] else "yes" if count["subjects"] else "not tried"))
        self.pages.append(
            "## Promises\n\n"
            "Each promise is measured at random places, points, rays, poses or motions, and then by climbing: small steps to larger\n"
            "and larger values from the 12 worst (`cli/lab/climb.h`, `tests/trust`). Distances and sides come from CGAL. A promise holds\n"
            "where the largest value is at most the limit: a ratio of what was found to what is promised (limit 1), or an excess in\n"
            "voxels (limit 0). \"Certificate\": it rests on the field's certificate.\n\n"
            f"{len(bodies)} meshes at 40 voxels, with up to six settings each (default, wide, narrow and unequal bands, field errors and\n"
            f"point spacings at their ends), {len(attacked)} bodies; {seed - self.arguments.first} rounds in {self.arguments.seconds:.0f} s.\n\n"
            + table(("promise", "says", "rests on", "limit", "bodies", "places", "largest of random", "largest by climbing", "holds"),
                    rows))

    def damaged_assets(self):
        a = self.arguments
        rows = []
        self.say("damaged assets")
        run = measured_run([self.program("fuzz", "fuzz_native"), str(a.seconds), str(a.first)])
        match = re.search(r"(\d+) mutants, of which (\d+) opened, in (\d+) s with (\S+):", run.out)
        if match:
            rows.append(("`fuzz_native`", f"widest vectors ({match[4]}), no sanitizers", f"{int(match[1]):,}", f"{int(match[2]):,}",
                         "no crash, no wrong answer, none too slow"))
        else:
            self.broken.append(f"fuzz_native: {(run.err or run.out).strip()}")
            rows.append(("`fuzz_native`", "", "", "", f"code {run.code}: {run.err.strip()}"))
        if a.fuzzer:
            self.say("damaged assets, libFuzzer")
            folder = os.path.join(self.work, "fuzz")
            os.makedirs(os.path.join(folder, "corpus"))
            subprocess.check_call([self.program("fuzz", "write_seeds"), os.path.join(folder, "seeds")])
            run = measured_run([a.fuzzer, f"-max_total_time={a.seconds:.0f}", f"-artifact_prefix={a.work}/", "-print_final_stats=1",
                                f"-seed={a.first + 1}", os.path.join(folder, "corpus"), os.path.join(folder, "seeds")])
            match = re.search(r"number_of_executed_units: (\d+)", run.err)
            if run.code != 0:
                self.broken.append(f"libFuzzer: code {run.code}, its finding is in {a.work}")
            rows.append(("libFuzzer", "AddressSanitizer, UndefinedBehaviorSanitizer", f"{int(match[1]):,}" if match else "", "",
                         "no finding" if run.code == 0 else f"code {run.code}"))
        self.pages.append(
            "## Damaged assets\n\n"
            "Assets of all kinds are changed in bytes, numbers, lengths and tables. Most get correct hashes again, so that they pass the\n"
            "checks of hashes. Those that open are asked every query, and one in eight everything else: views, exports, checks, Bullet.\n\n"
            + table(("program", "with", "mutants", "opened", "found"), rows))

    def damaged_meshes(self):
        self.say("damaged meshes")
        seeds = {}
        for name in ("cube", "torus"):
            vertices, faces = read_obj(os.path.join(ROOT, "sample_meshes", f"{name}.obj"))
            for suffix, write in WRITERS.items():
                seeds[name, suffix] = write(vertices, faces)
        counts, slowest = {suffix: collections.Counter() for suffix in WRITERS}, 0
        end = time.monotonic() + self.arguments.seconds
        number = self.arguments.first
        while time.monotonic() < end:
            for (name, suffix), bytes_ in seeds.items():
                mesh = os.path.join(self.work, f"mutant{suffix}")
                asset = os.path.join(self.work, "mutant.vps.hdf")
                with open(mesh, "wb") as file:
                    file.write(mutant(bytes_, random.Random(f"{number} {name}{suffix}")))
                count = counts[suffix]
                count["mutants"] += 1
                run = measured_run([self.vpsbake, mesh, "--resolution", "24", "-o", asset], LONGEST_S)
                slowest = max(slowest, run.seconds)
                outcome = {0: "baked", 2: "refused", 3: "refused"}.get(run.code, "failed")
                if outcome == "baked":
                    check = measured_run([self.vpsbake, "validate", asset, "--mesh", mesh, "--samples", "1000"], LONGEST_S)
                    outcome = "valid" if check.code == 0 else "not valid"
                    run = check if check.code else run
                count[outcome] += 1
                if outcome in ("failed", "not valid"):
                    kept = os.path.join(self.arguments.work, f"mutant_{number}_{name}{suffix}")
                    os.replace(mesh, kept)
                    self.broken.append(f"damaged mesh {kept}: {outcome}, code {run.code}: {last_line(run.err)}")
            number += 1
        names = ("mutants", "refused", "valid", "not valid", "failed")
        self.pages.append(
            "## Damaged meshes\n\n"
            "A cube and a torus in four formats are changed in their bytes. Each file is baked at 24 voxels: it must be refused with a\n"
            "documented exit code, or the asset must pass `vpsbake validate --mesh`.\n\n"
            + table(("format",) + names, [(suffix,) + tuple(f"{count[n]:,}" for n in names) for suffix, count in counts.items()])
            + f"\nThe slowest took {slowest:.1f} s.\n")

    def faults(self):
        self.say("faults")
        rows = []
        for name, chosen in FAULTS:
            result = os.path.join(self.work, "result.json")
            run = measured_run([self.program(name), f"--gtest_filter={chosen}", f"--gtest_output=json:{result}"], 4 * LONGEST_S)
            try:
                with open(result, encoding="utf-8") as file:
                    suites = json.load(file)["testsuites"]
            except OSError:
                self.broken.append(f"{name}: ends with code {run.code}")
                continue
            os.remove(result)
            for suite in suites:
                for test in suite["testsuite"]:
                    failed = "failures" in test
                    skipped = test.get("result") == "SKIPPED"
                    if failed:
                        self.broken.append(f"{suite['name']}.{test['name']} failed")
                    kills = f", {test['killed']} killed" if "killed" in test else ""
                    rows.append((f"{suite['name']}.{test['name']}{kills}", test["time"],
                                 "FAILED" if failed else "skipped" if skipped else "holds"))
        self.pages.append("## Faults\n\nBakes and batches are killed, disks are full, folders are read-only, files change while they are read.\n\n"
                          + table(("test", "time", "result"), rows))

    def corpus(self):
        self.say("the corpus")
        counts, rows = collections.Counter(), []
        asset = os.path.join(self.work, "corpus.vps.hdf")
        for mesh in self.meshes():
            counts["meshes"] += 1
            for repair in ("none", "fill", "wrap"):
                options = ["--repair", repair] if repair != "none" else []
                run = measured_run([self.vpsbake, mesh, "--resolution", RESOLUTION, "--fields", "layers,scaled,real", "-o", asset]
                                   + options, LONGEST_S)
                if run.code != 3:
                    break
            if run.code != 0:
                outcome = "refused" if run.code in (2, 3) else "failed"
            else:
                counts["repaired"] += repair != "none"
                run = measured_run([self.vpsbake, "validate", asset, "--mesh", mesh] + options, LONGEST_S)
                outcome = "valid" if run.code == 0 else "not valid"
            counts[outcome] += 1
            if outcome in ("failed", "not valid"):
                self.broken.append(f"{os.path.basename(mesh)}: {outcome}: {last_line(run.err)}")
                rows.append((os.path.basename(mesh), outcome, last_line(run.err).rsplit("; ", 1)[0]))
        self.pages.append(
            "## Meshes of a corpus\n\n"
            f"{counts['meshes']} meshes at {RESOLUTION} voxels with all fields, with the least repair that works, each checked with\n"
            f"`vpsbake validate --mesh`: {counts['valid']} valid ({counts['repaired']} of those baked are repaired), {counts['refused']} refused, "
            f"{counts['not valid']} not valid, {counts['failed']} fail otherwise.\n"
            + ("\n" + table(("mesh", "outcome", "reason"), rows) if rows else ""))


def last_line(text):
    lines = text.strip().splitlines()
    return re.sub(r"^vpsbake: error: (\S+/)?", "", lines[-1]) if lines else ""


def read_obj(path):
    vertices, faces = [], []
    with open(path, encoding="utf-8") as file:
        for line in file:
            kind, *words = line.split() or [""]
            if kind == "v":
                vertices.append(tuple(map(float, words[:3])))
            elif kind == "f":
                faces.append(tuple(int(word.split("/")[0]) - 1 for word in words))
    return vertices, faces


def obj_bytes(vertices, faces):
    return "".join([f"v {x} {y} {z}\n" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces]).encode()


def off_bytes(vertices, faces):
    return "".join([f"OFF\n{len(vertices)} {len(faces)} 0\n"] + [f"{x} {y} {z}\n" for x, y, z in vertices]
                   + [f"3 {a} {b} {c}\n" for a, b, c in faces]).encode()


def ply_bytes(vertices, faces):
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\n"
              f"property double z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    return header.encode() + b"".join([struct.pack("<3d", *v) for v in vertices] + [struct.pack("<B3i", 3, *f) for f in faces])


def stl_bytes(vertices, faces):
    triangles = [struct.pack("<12fH", 0, 0, 0, *(x for corner in face for x in vertices[corner]), 0) for face in faces]
    return bytes(80) + struct.pack("<I", len(faces)) + b"".join(triangles)


WRITERS = {".obj": obj_bytes, ".off": off_bytes, ".ply": ply_bytes, ".stl": stl_bytes}


def mutant(data, choose):
    """The bytes with one to six changes."""
    data = bytearray(data)
    for _ in range(choose.randint(1, 6)):
        at, length = choose.randrange(len(data)), choose.randint(1, 40)
        change = choose.randrange(5)
        if change == 0:
            data[at] ^= 1 << choose.randrange(8)
        elif change == 1:
            del data[at:at + length]
        elif change == 2:
            data[at:at] = data[at:at + length]
        elif change == 3:
            there = choose.randrange(len(data))
            data[at:at + length] = data[there:there + length]
        else:
            data[at:at + 1] = choose.choice((b"-", b"0", b"9", b"e", b".", b"nan", b"1e30", b"\n", b"\0", b"\xff\xff\xff\x7f"))
        if not data:
            return b"\n"
    return bytes(data)


PARTS = ("promises", "damaged_assets", "damaged_meshes", "faults", "corpus")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, help="folder of a build with tests")
    parser.add_argument("--fuzzer", help="fuzz_asset of a build with libFuzzer")
    parser.add_argument("--shared", help="folder that holds meshes/ and scenes/")
    parser.add_argument("--seconds", type=float, default=600, help="of each part that can last as long as one likes")
    parser.add_argument("--first", type=int, default=0, help="first number of the random choices")
    parser.add_argument("--starts", type=int, default=1000, help="random places for each promise, body and round")
    parser.add_argument("--parts", default=",".join(PARTS))
    parser.add_argument("--work", default=".", help="existing folder for what breaks something")
    parser.add_argument("-o", "--output", required=True, help="Markdown file")
    arguments = parser.parse_args()

    with tempfile.TemporaryDirectory(dir=arguments.work) as work:
        trust = Trust(arguments, work)
        for part in arguments.parts.split(","):
            getattr(trust, part)()
    verdict = ("Nothing broke in this run." if not trust.broken
               else "In this run these broke:\n\n" + "\n".join(f"- {text}" for text in trust.broken))
    os.makedirs(os.path.dirname(os.path.abspath(arguments.output)), exist_ok=True)
    with open(arguments.output, "w", encoding="utf-8") as file:
        file.write("\n".join([HEADER, verdict + "\n", *trust.pages, NOT_COVERED]))
    print(*trust.broken, sep="\n", file=sys.stderr)
    return 1 if trust.broken else 0


if __name__ == "__main__":
    sys.exit(main())
