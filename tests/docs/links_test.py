# SPDX-License-Identifier: GPL-3.0-or-later
"""Every document's links lead somewhere, every file that it names is there, and paper_map.md names functions that exist."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("bake", "cli", "docs", "formats", "runtime", "sample_meshes", "tests")
CODE = ("bake", "cli", "formats", "runtime")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
QUOTED = re.compile(r"`([^`\n]+)`")


def documents():
    return [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md")),
            *sorted((ROOT / "sample_meshes").glob("*.md"))]


def prose(text):
    """Without blocks of code, whose file names are examples."""
    return re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)


def anchors(document):
    """The headings of a document, as links spell them."""
    headings = re.findall(r"^#+ (.*)", prose(document.read_text()), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def dead_links(document):
    for link in LINK.findall(prose(document.read_text())):
        if re.match(r"\w+:", link):
            continue  # of the network
        name, _, anchor = link.partition("#")
        target = (document.parent / name) if name else document
        if not target.exists():
            yield f"{link}: no such file"
        elif anchor and anchor not in anchors(target):
            yield f"{link}: no such heading"


def missing_files(document):
    """A quoted name that begins with a folder of ours is a file of ours, from the root."""
    for quoted in QUOTED.findall(prose(document.read_text())):
        if not re.fullmatch(rf"({'|'.join(FOLDERS)})/[\w./*-]*", quoted):
            continue
        # `bake/stages/voxelize` stands for its header and its source.
        if not any(ROOT.glob(quoted.rstrip("/"))) and not any(ROOT.glob(quoted.rstrip("/") + ".*")):
            yield f"`{quoted}`: no such file"


def missing_functions():
    """In a cell of paper_map.md names stand before their file; names without a file are anywhere in the code."""
    text = {path.relative_to(ROOT).as_posix(): path.read_text() for folder in CODE
            for path in (ROOT / folder).rglob("*") if path.suffix in (".h", ".cpp")}
    everything = "\n".join(text.values())
    for cell in re.split(r"[|\n]", (ROOT / "docs/paper_map.md").read_text()):
        names = []
        for quoted in QUOTED.findall(cell):
            if quoted in text or quoted.endswith("/"):
                folder = [source for path, source in text.items() if path.startswith(quoted)]
                yield from (f"`{name}` is not in {quoted}" for name in names if not occurs(name, "\n".join(folder)))
                names = []
            else:
                names.append(quoted)
        yield from (f"`{name}` is nowhere" for name in names if not occurs(name, everything))


def occurs(name, text):
    return re.search(rf"\b{re.escape(name.split('::')[-1])}\b", text) is not None


def main():
    faults = [f"{document.relative_to(ROOT)}: {fault}" for document in documents()
              for check in (dead_links, missing_files) for fault in check(document)]
    faults += [f"docs/paper_map.md: {fault}" for fault in missing_functions()]
    print(*faults, sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
