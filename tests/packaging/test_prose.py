"""The English of documents, docstrings and comments, and the tables of documents.

No sentence opens with a word for its noun: "Of ten robots, none fell", "What is left is 3 mm" and
"Those are refused" make a reader look for what is meant. CONTRIBUTING.md asks for the noun.
"""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

OPENERS = re.compile(r"(?:^|(?<=[.!?:] ))[(*_]*(?:What|Whether|Of|Those|That|All)\b.{,60}")
NO_SENTENCE = re.compile(r"^( {4}|\s*$)")
"""Lines of code in Markdown, and empty ones."""
ITEM = re.compile(r"^\s*([-*|#]+|\d+\.)\s+")
PARTS = re.compile(r"\n\s*\n|^ *[\w*, ]+ : .*\n", re.MULTILINE)
"""The ends of a docstring's parts: empty lines, and a parameter's name and type."""
FOLDERS = (
    *("docs", "compile", "backends", "experiments", "hardware_models", "networks", "robot"),
    *("training", "benchmarks", "examples", "tests", "src/spikeport"),
)


WITH_DOCUMENTS = ("", "docs", "networks")


def documents(folder: Path) -> list[Path]:
    """Return the Markdown files of a folder; of the checkout itself, only those at its top."""
    found = sorted(folder.glob("*.md" if (folder / "Makefile").exists() else "**/*.md"))
    assert found
    return found


def paragraphs(text: str) -> Iterator[str]:
    """Yield the paragraphs, items and rows of a document in Markdown, without its code."""
    lines: list[str] = []
    is_code = False
    for line in [*text.splitlines(), ""]:
        is_code ^= line.lstrip().startswith("```")
        if is_code or NO_SENTENCE.match(line) or ITEM.match(line):
            yield " ".join(lines)
            lines = []
        if not is_code and not NO_SENTENCE.match(line):
            lines.append(ITEM.sub("", line).strip())


def docstrings(code: str) -> Iterator[str]:
    """Yield the paragraphs of all texts that stand by themselves in a module."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            for text in PARTS.split(str(node.value.value)):
                yield " ".join(text.split())


def comments(code: str) -> Iterator[str]:
    """Yield comments, each with the lines that go on below it in the same column."""
    text, end = "", (0, 0)
    for token in tokenize.generate_tokens(io.StringIO(code).readline):
        if token.type == tokenize.COMMENT:
            goes_on = token.start == (end[0] + 1, end[1])
            if not goes_on:
                yield text
            text = f"{text if goes_on else ''} {token.string.lstrip('# ')}".strip()
            end = token.start
    yield text


def openers(texts: Iterator[str]) -> list[str]:
    """Return the beginnings of the sentences that lack their noun."""
    return [found.group() for text in texts for found in OPENERS.finditer(text)]


def test_openers_are_found_and_other_sentences_are_not() -> None:
    text = "# What is left\n\nNone.\nOf ten, none.\n\n- All fell: that is so.\n\n    Of code\n"
    assert openers(paragraphs(text)) == ["What is left", "Of ten, none.", "All fell: that is so."]
    code = 'def f():\n    """Return x.\n\n    Those.\n    """\n    # A word. That\n    # is it.\n'
    assert openers(docstrings(code)) == ["Those."]
    assert openers(comments(code)) == ["That is it."]
    code = 'def f():\n    """Return x.\n\n    x : array, optional\n        What is read.\n    """\n'
    assert openers(docstrings(code)) == ["What is read."]


@pytest.mark.parametrize("folder", WITH_DOCUMENTS)
def test_no_document_opens_a_sentence_without_its_noun(root: Path, folder: str) -> None:
    files = documents(root / folder)
    found = {str(path): openers(paragraphs(path.read_text(encoding="utf-8"))) for path in files}
    assert {path: texts for path, texts in found.items() if texts} == {}


def broken_tables(text: str) -> list[str]:
    """Return the rows of tables with more or fewer cells than the row before them."""
    sizes = [
        (line, len(re.findall(r"(?<!\\)\|", re.sub(r"`[^`]*`", "", line))))
        for line in text.splitlines()
    ]
    return [
        line
        for (line, n), (before, m) in zip(sizes[1:], sizes, strict=False)
        if line.startswith("|") and before.startswith("|") and n != m
    ]


def test_rows_of_tables_with_too_many_cells_are_found() -> None:
    table = "| a | `b|c` |\n|---|---|\n| 1 | x \\| y |\n"
    assert broken_tables(table) == []
    assert broken_tables(table + "| 2 | 3 | | 4 | 5 |\n") == ["| 2 | 3 | | 4 | 5 |"]


@pytest.mark.parametrize("folder", WITH_DOCUMENTS)
def test_every_row_of_a_table_has_a_cell_for_each_column(root: Path, folder: str) -> None:
    files = documents(root / folder)
    found = {str(path): broken_tables(path.read_text(encoding="utf-8")) for path in files}
    assert {path: rows for path, rows in found.items() if rows} == {}


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_docstring_or_comment_opens_a_sentence_without_its_noun(root: Path, folder: str) -> None:
    found = {}
    for path in (root / folder).rglob("*.py"):
        code = path.read_text(encoding="utf-8")
        found[str(path)] = [*openers(docstrings(code)), *openers(comments(code))]
    assert {path: texts for path, texts in found.items() if texts} == {}
