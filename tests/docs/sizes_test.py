# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages for users stay short: README.md and docs/*.md have at most 20,000 words together, and a sentence has at most 35."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MOST_WORDS, MOST_IN_A_SENTENCE = 20_000, 35
CODE = re.compile(r"^```.*?^```|^    [^\n]*", flags=re.M | re.S)


def words(text):
    return [word for word in text.split() if re.search(r"\w", word)]


def sentences(text):
    """Those of paragraphs, list items and cells of tables; a link counts as its text."""
    prose = re.sub(r"!?\[([^\]]*)\]\([^)\s]*\)", r"\1", CODE.sub("", text))
    for part in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.|#+) |\||\A#+ ", prose):
        yield from re.split(r"[.?!:][*`\")]*\s+(?=[*\"(]*[A-Z0-9`])", " ".join(part.split()))


def main():
    faults = [f"{page.relative_to(ROOT)}: {len(words(sentence))} words: {sentence}" for page in PAGES
              for sentence in sentences(page.read_text()) if len(words(sentence)) > MOST_IN_A_SENTENCE]
    total = sum(len(words(page.read_text())) for page in PAGES)
    if total > MOST_WORDS:
        faults.append(f"{total} words in all: move measurements to docs/internals, and say each thing once")
    print(*faults, sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
