"""The words of the project: class names used twice or as words, docstrings that open with a question, replaced words.

The bars are counts that may only fall: a lower count is to be written here, a higher one fails.
"""

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from pathlib import Path

QUESTION = re.compile(r"(Which|What|Whether|How|Who|Whose|Where|When|Why)\b")
"""First words of a docstring that means a value without naming it."""
UNNAMED = re.compile(r'^\s*(?:"""|\*{0,2}\w+: )Of\b', re.MULTILINE)
"""Description of an attribute or argument that continues its name and does not stand alone."""
REPLACED = (
    "hear", "hears", "heard", "unheard", "hearing", "listen", "listens", "listening", "listener", "deaf", "ear", "ears",
    "told", "tell", "tells", "telling", "ask", "asks", "asked", "asking", "answer", "answers", "answered", "say",
    "says", "said", "saying", "speak", "speaks", "meets", "met", "drown", "drowned", "stance", "mouth", "nobody",
    "somebody", "who", "whom", "whoever", "laid", "whence", "noun", "nouns", "owner", "owners", "loud", "louder",
    "loudest", "loudness", "faint", "fainter", "audible", "guilty", "dear", "dearer", "owes", "owed", "learnt", "obeys",
    "obey", "forgets", "wanted", "bent", "bounce off", "bounces off", "bounced off", "under way", "quick way",
)  # fmt: skip
"""Words that `docs/glossary.md` replaces, in identifiers (each part of them), docstrings, comments, messages, texts."""
PACKAGE = ("mirrored", "from memory")
"""Words that the package alone replaces; tests may mirror a world and read a recording from memory."""
NAMES = ("way", "ways", "place", "places", "wants", "cause", "causes", "room", "rooms")
"""Words that are no names of values in the package: path, direction, position, location, contribution, buffer."""
ALLOWED = {
    "learnt": ("src/insonify/former_names.py", "tests/test_former_names.py"),  # a former value of scenarios
    "owners": ("src/insonify/formats/label_store.py",),  # an attribute of stored labels
    "whence": ("src/insonify/former_names.py", "tests/test_former_names.py"),
    "listen": ("tests/cli/test_serve.py",),  # of a socket
    "listener": (
        "src/insonify/cli/compile_progress.py",
        "src/insonify/jit.py",
        "tests/test_jit.py",
        "benchmarks/record_kernels.py",
    ),  # a class of numba
    "noun": ("CONTRIBUTING.md",),  # of grammar
    "place": ("src/insonify/former_names.py",),
}
"""Files in which a replaced word stands for something else, by word."""
FOLDERS = ("src", "tests", "benchmarks", "examples", "tools")
"""Folders of sources; class names and docstrings count in the first alone."""
TEXTS = (
    "*.md", "Makefile", "pyproject.toml", "CHANGELOG.d/*.md", "docs/**/*.md", "tests/**/*.md", "examples/*.yaml",
    "src/**/*.yaml", "tests/**/*.yaml",
)  # fmt: skip
"""Texts in which replaced words count: pages, and scenarios, those of the templates included."""
UNREAD = ("CODE_OF_CONDUCT.md", "docs/glossary.md", "docs/decisions/0052-names-are-the-fields.md")
"""Texts about people and about the replaced words."""
CLASS_NAME = re.compile(r"[A-Z]+[a-z0-9]+(?:[A-Z][A-Za-z0-9]*)+")
"""Names of classes and types that are no words."""
BARS = {
    "class names used twice": 0,
    "class names as words": 0,
    "docstrings that open with a question": 0,
    "descriptions that open with Of": 0,
    "replaced words": 0,
}
"""Occurrences of each kind."""


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


def unnamed_values(texts: dict[str, str]) -> list[str]:
    """Descriptions in the package that begin with Of."""
    return [
        f"{name}:{text.count(chr(10), 0, match.end()) + 1}: Of"
        for name, text in texts.items()
        if name.startswith("src/")
        for match in UNNAMED.finditer(text)
    ]


def class_names_as_words(texts: dict[str, str], trees: dict[str, ast.Module]) -> list[str]:
    """Sentences of docstrings and comments that begin with the name of a class or type of the package, unmarked."""
    names = set()
    for tree in trees.values():
        names |= {node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
        targets = [target for node in tree.body if isinstance(node, ast.Assign) for target in node.targets]
        names |= {target.id for target in targets if isinstance(target, ast.Name)}
    named = "|".join(sorted(filter(CLASS_NAME.fullmatch, names), key=len, reverse=True))
    if not named:
        return []
    opening = re.compile(rf'(?:\A(?:#|[rR]?""")|[.!?:]\s|\n\s*\n)\s*({named})(?! =)(?=[ ,;\n])')
    found = []
    for name, text in texts.items():
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT or '"""' in token.string[:4]:
                for match in opening.finditer(token.string):
                    line = token.start[0] + token.string.count("\n", 0, match.start(1))
                    found.append(f"{name}:{line}: {match[1]}")
    return found


DUNDER = re.compile(r"__[a-z]+__")
"""Names that Python gives."""


def _pattern(words: tuple[str, ...]) -> re.Pattern[str]:
    """Any of some words in lower, upper or title case, on its own or as a part of a name in snake or camel case."""
    lower, title = "|".join(words), "|".join(word[0].upper() + word[1:] for word in words)
    small = rf"(?:(?<![A-Za-z])(?:{lower}|{title})|(?<=[a-z])(?:{title}))(?![a-z])"
    return re.compile(rf"{small}|(?<![A-Za-z])(?:{lower.upper()})(?![A-Za-z])")


def replaced_words(texts: dict[str, str]) -> list[str]:
    """Words of the glossary's second table, line by line; in the package, names of values too."""
    word, package_word, name_part = _pattern(REPLACED), _pattern(REPLACED + PACKAGE), _pattern(NAMES)
    found = [
        f"{name}:{number}: {match[0]}"
        for name, text in texts.items()
        for number, line in enumerate(text.splitlines(), start=1)
        for match in (package_word if name.startswith("src/") else word).finditer(DUNDER.sub("", line))
        if name not in ALLOWED.get(match[0].lower(), ())
    ]
    for name, text in texts.items():
        if name.startswith("src/") and name.endswith(".py") and name not in ALLOWED["place"]:
            for token in tokenize.generate_tokens(io.StringIO(text).readline):
                if token.type == tokenize.NAME and not re.search(r"(?i)(one|two|in)_(way|place)", token.string):
                    found += [
                        f"{name}:{token.start[0]}: {match[0]}"
                        for match in name_part.finditer(DUNDER.sub("", token.string))
                    ]
    return found


def main(root: Path, *, listed: bool) -> int:
    """Compare the counts of a project with the bars, and print what is above, or everything.

    Args:
        root: Folder that holds `src`, `tests` and the rest.
        listed: Whether every occurrence is printed.

    Returns:
        1 where a count differs from its bar, else 0.
    """
    texts = {
        p.relative_to(root).as_posix(): p.read_text(encoding="utf-8")
        for folder in FOLDERS
        for p in sorted((root / folder).rglob("*.py"))
        if p.stem not in ("words", "test_words")
    }
    trees = {name: ast.parse(text, name) for name, text in texts.items() if name.startswith("src/")}
    pages = {
        name: p.read_text(encoding="utf-8")
        for pattern in TEXTS
        for p in sorted(root.glob(pattern))
        if (name := p.relative_to(root).as_posix()) not in UNREAD
    }
    lists = (
        repeated_classes(trees), class_names_as_words(texts, trees), questions(trees), unnamed_values(texts),
        replaced_words(texts | pages),
    )  # fmt: skip
    found = dict(zip(BARS, lists, strict=True))
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
