# SPDX-License-Identifier: GPL-3.0-or-later
"""The changelog begins with a section for what is not released; the next one is the project's version, with its day.

usage: changelog_test.py VERSION
"""
import re
import sys
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def main():
    headings = re.findall(r"^## (.*)", (ROOT / "CHANGELOG.md").read_text(), flags=re.M)
    assert headings[0] == "[Unreleased]", headings[0]
    version, day = re.fullmatch(r"\[([\d.]+)\] - ([\d-]+)", headings[1]).groups()
    date.fromisoformat(day)
    assert version == sys.argv[1], f"the newest release of the changelog is {version}, the project's version {sys.argv[1]}"
    return 0


if __name__ == "__main__":
    sys.exit(main())
