#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints how many tests were skipped and why, one line for each reason, from the file of `ctest --output-junit`."""
import re
import sys
import xml.etree.ElementTree as ElementTree


def reasons(test):
    """The reasons of the tests that a CTest test skipped: one or none, but several for a shard."""
    output = test.findtext("system-out") or ""
    # Google Test prints the source line, then the reason; a script's last line is the reason.
    stated = re.findall(r": Skipped\n(.*)", output)
    if not stated and test.find("skipped") is not None:
        stated = (output.strip().splitlines() or ["no reason stated"])[-1:]
    return ["no ../shared" if re.search(r"\.\./shared\b", why) else why for why in stated]


def main():
    by_reason = {}
    for test in ElementTree.parse(sys.argv[1]).iter("testcase"):
        for why in reasons(test):
            by_reason.setdefault(why, []).append(test.get("name"))
    for why, names in sorted(by_reason.items()):
        print(f"{len(names)} {'test' if len(names) == 1 else 'tests'} skipped: {why}: {', '.join(names)}")


if __name__ == "__main__":
    main()
