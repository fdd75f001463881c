#!/usr/bin/env python3
"""Reports comment lines of Rust files that are longer than 100 columns: check-comments.py FOLDER_OR_FILE...

rustfmt wraps comments on nightly toolchains only (`wrap_comments`). Lines that cannot be wrapped are ignored: a single word
such as a URL, also in a list or as the target of a link; tables and fenced code in doc comments. Standard library only.
"""

import re
import sys
from pathlib import Path

WIDTH = 100

# Tokens that can contain `//`: strings are matched so that text in them is no comment.
TOKEN = re.compile(
    r"""
    (?P<line>//[^\n]*)
    | (?P<block>/\*.*?\*/)
    | \b[bc]?r(?P<hashes>\#*)".*?"(?P=hashes)
    | "(?:\\.|[^"\\])*"
    | '(?:\\[^\n]*?|[^\\'\n])'
    """,
    re.VERBOSE | re.DOTALL,
)

MARKER = re.compile(r"\s*(///|//!|//|/\*\*|/\*!|/\*|\*)?\s*")

# The start of a list item, or of a link's target: `[name]: URL`.
PREFIX = re.compile(r"([-*+]|\d+[.)]|\[[^\]]*\]:)\s+")


def comment_lines(text: str):
    """The lines that contain only a comment: number from 0, and whether it is a line doc comment."""
    for token in TOKEN.finditer(text):
        if token["line"] is None and token["block"] is None:
            continue
        start = text.rfind("\n", 0, token.start()) + 1
        if text[start : token.start()].strip():
            continue
        first = text.count("\n", 0, token.start())
        is_doc = re.match(r"///(?!/)|//!", token[0]) is not None
        for number in range(first, first + token[0].count("\n") + 1):
            yield number, is_doc


def long_lines(text: str):
    """The comment lines that are too long: number from 1, and columns."""
    lines = text.split("\n")
    fence, last = None, None
    for number, is_doc in comment_lines(text):
        line = lines[number]
        content = line[MARKER.match(line).end() :]
        if not is_doc or last is None or number != last + 1:
            fence = None
        last = number if is_doc else None
        if is_doc:
            if fence is None:
                opening = re.match(r"`{3,}|~{3,}", content)
                if opening:
                    fence = opening[0]
                    continue
            else:
                if content.startswith(fence) and not content.strip(fence[0] + " "):
                    fence = None
                continue
            if content.startswith("|"):
                continue
        if len(line) <= WIDTH or len(PREFIX.sub("", content, count=1).split()) <= 1:
            continue
        yield number + 1, len(line)


def main(arguments: list[str]) -> int:
    if not arguments:
        print(__doc__, file=sys.stderr)
        return 2
    found = 0
    for path in map(Path, arguments):
        if not path.exists():
            print(f"{path} does not exist", file=sys.stderr)
            return 2
        files = sorted(path.rglob("*.rs")) if path.is_dir() else [path]
        for file in files:
            for number, columns in long_lines(file.read_text(encoding="utf-8")):
                print(f"{file}:{number}: a comment of {columns} columns, {WIDTH} at most")
                found += 1
    if found:
        print(f"{found} comment lines are too long", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
