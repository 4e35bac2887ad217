# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares what a page shows with what was printed."""
import re

NUMBER = r"\d[\d,]*\.?\d*(?:e[+-]?\d+)?"
TIME = re.compile(rf"{NUMBER}(?= ?(?:s|ms|us|ns|min)\b)")


def agrees(shown, printed, tolerance=0.05):
    """Whether two texts have the same words and nearly the same numbers, which depend slightly on the machine. Times
    may be any."""
    texts = [TIME.sub("TIME", " ".join(text.split())) for text in (shown, printed)]
    if len({re.sub(NUMBER, "#", text) for text in texts}) > 1:
        return False
    pairs = zip(*(re.findall(NUMBER, text) for text in texts))

    def is_near(a, b):
        last = max(10.0 ** -len(x.partition(".")[2]) for x in (a, b) if "e" not in x) if "e" not in a + b else 0
        x, y = (float(n.replace(",", "")) for n in (a, b))
        return abs(x - y) <= tolerance * max(abs(x), abs(y)) + last

    return all(is_near(a, b) for a, b in pairs)
