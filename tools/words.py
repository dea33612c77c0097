"""The words of the code: class names that are used twice, docstrings that open with a question, words of no textbook.

The bars are counts that may only fall: a lower count is to be written here, a higher one fails.
"""

import ast
import re
import sys
from collections import Counter
from pathlib import Path

QUESTION = re.compile(r"(Which|What|Whether|How|Who|Whose|Where|When|Why)\b")
"""First words of a docstring that say that a value is meant without naming it."""
REPLACED = (
    "hear", "hears", "heard", "hearing", "listen", "listens", "listening", "deaf", "told", "tell", "tells", "ask",
    "asks", "asked", "answer", "answers", "answered", "meets", "met", "drowned", "stance", "mouth", "ears",
    "nobody", "somebody", "whoever", "laid", "whence", "noun", "nouns", "owner", "loud", "louder", "loudest",
    "loudness", "audible", "guilty",
)  # fmt: skip
"""Words that `docs/glossary.md` replaces, in identifiers (between underscores), docstrings, comments and messages."""
BARS = {"class names used twice": 0, "docstrings that open with a question": 0, "replaced words": 1}
"""Occurrences of each kind; the one replaced word is a former key of scenarios."""


def repeated_classes(trees: dict[str, ast.Module]) -> list[str]:
    """Class names that are defined in more than one place, with the places."""
    places: dict[str, list[str]] = {}
    for name, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(f"{name}:{node.lineno}")
    return [f"{', '.join(at)}: class {name}" for name, at in places.items() if len(at) > 1]


def questions(trees: dict[str, ast.Module]) -> list[str]:
    """Docstrings, those of attributes included, whose first word is a question."""
    found = []
    for name, tree in trees.items():
        for node in ast.walk(tree):
            body = getattr(node, "body", None)
            for line in body if isinstance(body, list) else ():
                if (
                    isinstance(line, ast.Expr)
                    and isinstance(line.value, ast.Constant)
                    and isinstance(line.value.value, str)
                ):
                    text = line.value.value.strip()
                    if QUESTION.match(text):
                        found.append(f"{name}:{line.lineno}: {text.splitlines()[0][:60]}")
    return found


def replaced_words(texts: dict[str, str]) -> list[str]:
    """Words of the glossary's second table, line by line."""
    word = re.compile(rf"(?<![A-Za-z])({'|'.join(REPLACED)})(?![A-Za-z])")
    return [
        f"{name}:{number}: {match[1]}"
        for name, text in texts.items()
        for number, line in enumerate(text.splitlines(), start=1)
        for match in word.finditer(line)
    ]


def main(root: Path, *, listed: bool) -> int:
    """Compare the counts of a project with the bars, and print what is above, or everything.

    Args:
        root: Folder that holds `src`.
        listed: Whether every occurrence is printed.

    Returns:
        1 where a count differs from its bar, else 0.
    """
    texts = {
        p.relative_to(root).as_posix(): p.read_text(encoding="utf-8") for p in sorted((root / "src").rglob("*.py"))
    }
    trees = {name: ast.parse(text, name) for name, text in texts.items()}
    found = dict(zip(BARS, (repeated_classes(trees), questions(trees), replaced_words(texts)), strict=True))
    wrong = False
    for kind, places in found.items():
        print(f"{kind}: {len(places)} (bar {BARS[kind]})")
        if len(places) < BARS[kind]:
            print("  fewer than the bar: lower it in tools/words.py")
        for place in places if listed or len(places) > BARS[kind] else ():
            print(f"  {place}")
        wrong |= len(places) != BARS[kind]
    if listed:
        print(Counter(place.rsplit(": ", 1)[1] for place in found["replaced words"]).most_common())
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main(Path(__file__).parents[1], listed="--list" in sys.argv[1:]))
