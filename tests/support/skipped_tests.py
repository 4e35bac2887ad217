#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints how many tests were skipped and why, one line for each reason, from the file of `ctest --output-junit`."""
import re
import sys
import xml.etree.ElementTree as ElementTree


def reason(output):
    """The reason that a skipped test printed."""
    if re.search(r"\.\./shared\b", output):
        return "no ../shared"
    # Google Test prints the source line, then the reason; a script's last line is the reason.
    stated = re.search(r": Skipped\n(.*)", output)
    lines = output.strip().splitlines()
    return stated.group(1) if stated else lines[-1] if lines else "no reason stated"


def main():
    by_reason = {}
    for test in ElementTree.parse(sys.argv[1]).iter("testcase"):
        if test.find("skipped") is not None:
            by_reason.setdefault(reason(test.findtext("system-out") or ""), []).append(test.get("name"))
    for why, names in sorted(by_reason.items()):
        print(f"{len(names)} {'test' if len(names) == 1 else 'tests'} skipped: {why}: {', '.join(names)}")


if __name__ == "__main__":
    main()
