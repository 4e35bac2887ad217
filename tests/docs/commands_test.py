# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands and options of vpsbake that the documents name exist, and so do the exit codes and the environment of command_line.md.

usage: commands_test.py VPSBAKE
"""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# The changelog names what is gone, decisions what was tried.
DOCUMENTS = [ROOT / "README.md", *(path for path in sorted((ROOT / "docs").rglob("*.md")) if path.name != "decisions.md")]
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
# Options of other programs that the text names by themselves.
FOREIGN = {"--component", "--config-settings", "--cpus", "--only", "--points", "--system-site-packages", "--user", "--without-hacd", "--work"}


def output(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout


def options_of(vpsbake):
    """Command -> its options. The key of the program itself is the empty string, that of `cache prune` "cache prune"."""
    def add(command):
        text = output(vpsbake, *command.split(), "--help")
        found[command] = set(OPTION.findall(text))
        listed = re.search(r"^Commands .*\n((?:  .*\n)+)", text, flags=re.M)
        for name in re.findall(r"^  ([a-z][a-z-]*)", listed[1], flags=re.M) if listed else ():
            add(f"{command} {name}".strip())

    found = {}
    add("")
    add("help-files")  # not listed
    return found


def calls(text):
    """The calls of vpsbake in code: the words behind the program's name, without comments and what follows in a pipe."""
    code = re.findall(r"`(?:[\w/]*/)?vpsbake ([^`]*)`", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S))
    for block in re.findall(r"^```.*?\n(.*?)^```", text, flags=re.M | re.S) + re.findall(r"^    (.*)", text, flags=re.M):
        code += re.findall(r"^\s*(?:[\w/]*/)?vpsbake (.*)", block.replace("\\\n", " "), flags=re.M)
    return [re.split(r"  #| \|(?!\|) |[;&]", call)[0].split() for call in code]


def faults(document, options):
    text = document.read_text()
    for words in calls(text):
        command = ""
        while words and f"{command} {words[0]}".strip() in options:
            command = f"{command} {words.pop(0)}".strip()
        if not command and words and re.fullmatch(r"[a-z][a-z-]*", words[0]):
            yield f"there is no command {words[0]}"
        elif command != "help":
            known = options[command]
            for option in OPTION.findall(" ".join(words)):
                if option not in known:
                    yield f"vpsbake {command} has no option {option}"
    everything = set().union(*options.values())
    for option in re.findall(r"`(--[a-z][a-z-]*)[^`]*`", text):
        if option not in everything | FOREIGN:
            yield f"no command has an option {option}"


def table(name):
    """The first cells of the table of command_line.md whose head begins with this name."""
    rows = re.search(rf"^\| {name} \|.*\n\|[-|]+\|\n((?:\|.*\n)+)", (ROOT / "docs/command_line.md").read_text(), flags=re.M)[1]
    return [row.split("|")[1].strip(" `") for row in rows.splitlines()]


def main():
    vpsbake = sys.argv[1]
    options = options_of(vpsbake)
    assert "--voxel" in options[""] and "--max-size" in options["cache prune"], options
    found = [f"{document.relative_to(ROOT)}: {fault}" for document in DOCUMENTS for fault in faults(document, options)]
    with tempfile.TemporaryDirectory() as folder:
        output(vpsbake, "help-files", "--into", folder)
        page = Path(folder, "man/man1/vpsbake.1").read_text()
    for name, stated in (("exit code", re.findall(r"(\d) ", page.split(".SH EXIT STATUS\n")[1].splitlines()[0])),
                         ("environment", re.findall(r"^\.B ([A-Z_]+)$", page.split(".SH ENVIRONMENT")[1], flags=re.M))):
        if table(name) != stated:
            found.append(f"docs/command_line.md: {name}: {table(name)}, but the manual page has {stated}")
    print(*found, sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
