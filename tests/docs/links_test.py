# SPDX-License-Identifier: GPL-3.0-or-later
"""The targets of all links in the documents exist, the files that they name exist, and so do the functions in paper_map.md. The index
names every document.

usage: links_test.py [FOLDER]    FOLDER: only the links of installed documents
"""
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
    """The text without code blocks, whose file names are examples."""
    return re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)


def anchors(document):
    """The headings of a document in the form that links use."""
    headings = re.findall(r"^#+ (.*)", prose(document.read_text()), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def dead_links(document):
    for link in LINK.findall(prose(document.read_text())):
        if re.match(r"\w+:", link):
            continue  # a network address
        name, _, anchor = link.partition("#")
        target = (document.parent / name) if name else document
        if not target.exists():
            yield f"{link}: no such file"
        elif anchor and anchor not in anchors(target):
            yield f"{link}: no such heading"


def missing_files(document):
    """Quoted names that start with a folder of the project but name no file of it."""
    for quoted in QUOTED.findall(prose(document.read_text())):
        if not re.fullmatch(rf"({'|'.join(FOLDERS)})/[\w./*-]*", quoted):
            continue
        # `bake/stages/voxelize` means its header and its source.
        if not any(ROOT.glob(quoted.rstrip("/"))) and not any(ROOT.glob(quoted.rstrip("/") + ".*")):
            yield f"`{quoted}`: no such file"


def missing_in_index():
    index = ROOT / "docs/README.md"
    linked = {(index.parent / link).resolve() for link in LINK.findall(index.read_text())}
    for document in sorted(index.parent.rglob("*.md")):
        if document != index and document not in linked:
            yield f"{document.relative_to(ROOT)} is not in it"


def missing_functions():
    """Functions that paper_map.md names but the code lacks.

    In a cell, names precede their file; names without a file may be anywhere in the code.
    """
    text = {path.relative_to(ROOT).as_posix(): path.read_text() for folder in CODE
            for path in (ROOT / folder).rglob("*") if path.suffix in (".h", ".cpp")}
    everything = "\n".join(text.values())
    for cell in re.split(r"[|\n]", (ROOT / "docs/internals/paper_map.md").read_text()):
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
    if len(sys.argv) > 1:
        installed = sorted(Path(sys.argv[1]).rglob("*.md"))
        faults = [f"{document}: {fault}" for document in installed for fault in dead_links(document)]
        print(*faults, sep="\n")
        return 1 if faults or not installed else 0
    faults = [f"{document.relative_to(ROOT)}: {fault}" for document in documents()
              for check in (dead_links, missing_files) for fault in check(document)]
    faults += [f"docs/internals/paper_map.md: {fault}" for fault in missing_functions()]
    faults += [f"docs/README.md: {fault}" for fault in missing_in_index()]
    print(*faults, sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
