"""Words that only this project uses, and the longest sentences: ``python -m tools.prose``, in ``make lint``.

A word of the list is an error in README.md and docs/*.md. In settings, help texts and docstrings it is only
printed.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from statistics import mean, quantiles
from typing import Final, NamedTuple

from markdown_it import MarkdownIt

ROOT: Final = Path(__file__).parents[1]
PAGES: Final = ("README.md", "docs/*.md")
SETTINGS: Final = ("config.yaml", "config/**/*.yaml", "studies/*/config.yaml")
LONGEST: Final = 10
SHOWN: Final = {"code_inline": "`...`", "softbreak": "\n", "hardbreak": "\n"}
"""What is read in place of a part of a text: code is one word."""
THINGS: Final = "(?:answer|column|command|file|model|network|page|program|report|row|study|table|verdict)"
PLAIN: Final = {
    "asked of": "tested on",
    "bears? out": "supports",
    "c[ao]me twice": "was recorded twice",
    "cr(?:y|ies|ied) wolf": "false alarm",
    "dear": "costly",
    "exams?": "test, validation",
    "for granted": "assumed",
    "give or take": "within",
    "held against": "compared with",
    "hold(?:s|ing)? the truth": "contain",
    "(?:is|are) (?:not )?told": "estimated, reported",
    "in a word": "in short",
    "kn[eo]ws? nothing": "has no information",
    "lest": "so that ... not",
    "luck": "chance",
    "makes? good": "corrects",
    "may be read": "can be used",
    "mended": "fixed",
    "one's fingers": "interactive",
    "other people's": "of other models",
    "reads? well": "a statement of what is good",
    "sat|sittings?": "test, run",
    "speaks?|spoke": "reports, contradicts",
    "stands? behind": "supports",
    "to the bit": "bit for bit",
    "told (?:apart|from)": "distinguished, estimated from",
    "worst first": "limitations",
    f"{THINGS}(?: (?:says|tells)|s (?:say|tell))": "reports, states",
}
"""What is written plainly, by the regular expression of what is not."""
JARGON: Final = {
    re.compile(rf"(?i)\b(?:{words})\b".replace(" ", r"\s+")): plain for words, plain in PLAIN.items()
}
END: Final = re.compile(
    r"(?<=[.!?])(?<!\bal\.)(?<!\b(?:Eq|eg|vs)\.)(?<!\b(?:Sec|Fig)\.)(?<!e\.g\.)(?<!i\.e\.)\s+(?=\W*[A-Z0-9]|`|\$|swesbi)"
)
"""Where a sentence ends."""


class Text(NamedTuple):
    """Some text: where it begins, what it is, and whether it consists of sentences."""

    file: Path
    line: int
    text: str
    sentences: bool = False


def of_page(file: Path) -> Iterator[Text]:
    """Yield the paragraphs, headings and cells of a page."""
    tokens = MarkdownIt().enable("table").parse(file.read_text(encoding="utf-8"))
    line = 0
    for before, token in zip(tokens, tokens[1:], strict=False):
        line = token.map[0] + 1 if token.map else line
        if token.type == "inline":
            parts = (SHOWN.get(part.type, part.content) for part in token.children or [])
            yield Text(file, line, "".join(parts), before.type == "paragraph_open")


def of_code(file: Path) -> Iterator[Text]:
    """Yield docstrings of what is public in a module, and texts of help."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and node.body:
            if not getattr(node, "name", "").startswith("_") and (
                found := ast.get_docstring(node, clean=False)
            ):
                yield Text(file, node.body[0].lineno, found)
        elif isinstance(node, ast.keyword) and node.arg in ("help", "description", "epilog"):
            for part in ast.walk(node.value):
                if isinstance(part, ast.Constant) and isinstance(part.value, str):
                    yield Text(file, part.lineno, part.value)


def of_settings(file: Path) -> Iterator[Text]:
    """Yield the comments of a file of settings."""
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
        yield Text(file, number, line.partition("#")[2])


def jargon(texts: list[Text], root: Path) -> list[str]:
    """Return a line for each word of the list: file, line, word, and what is plain."""
    return [
        f"{text.file.relative_to(root)}:{text.line + text.text.count(chr(10), 0, match.start())}: "
        f"{' '.join(match[0].split())!r}; plain: {plain}"
        for text in texts
        for pattern, plain in JARGON.items()
        for match in pattern.finditer(text.text)
    ]


def main(root: Path = ROOT) -> int:
    """Print words and sentences; return 1 where a page has a word of the list, else 0."""
    pages = [file for each in PAGES for file in sorted(root.glob(each))]
    texts = {file: list(of_page(file)) for file in pages}
    elsewhere = [text for each in SETTINGS for file in sorted(root.glob(each)) for text in of_settings(file)]
    elsewhere += [text for file in sorted((root / "src").rglob("*.py")) for text in of_code(file)]
    found: list[tuple[int, str]] = []
    total = 0
    print(f"{'words':>7} {'mean':>5} {'p90':>4}  of a sentence, by page")
    for file, of_file in texts.items():
        words = sum(len(text.text.split()) for text in of_file)
        each = [
            (len(sentence.split()), f"{file.relative_to(root)}:{text.line}: {' '.join(sentence.split())}")
            for text in of_file
            if text.sentences
            for sentence in END.split(text.text)
        ]
        lengths = [length for length, _ in each] or [0]
        p90 = quantiles([*lengths, *lengths], n=10)[-1]
        print(f"{words:7} {mean(lengths):5.1f} {p90:4.0f}  {file.relative_to(root)}")
        found, total = found + each, total + words
    print(f"{total:7}             in all")
    print("\nThe longest sentences, in words:")
    for length, sentence in sorted(found, reverse=True)[:LONGEST]:
        print(f"{length:4} {sentence}")
    in_pages = jargon([text for of_file in texts.values() for text in of_file], root)
    for where, lines in (("elsewhere", jargon(elsewhere, root)), ("in pages", in_pages)):
        print(f"\nWords that only this project uses, {where}: {len(lines)}", *lines, sep="\n")
    return 1 if in_pages else 0


if __name__ == "__main__":
    sys.exit(main())
