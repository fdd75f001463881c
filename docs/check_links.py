#!/usr/bin/env python3
"""Checks relative links, anchors and pictures of the guide and of README.md, ARCHITECTURE.md and CHANGELOG.md.

  python3 docs/check_links.py

Prints each dead link with file and line, and exits with status 1 if there are any. Links to other sites are not checked.
In the guide, links must stay in docs/src, and each page must be in SUMMARY.md: the rendered book has nothing else.
"""
import re
import sys
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parent.parent
BOOK = ROOT / "docs" / "src"
FENCE = re.compile(r"^\s*(```+|~~~+)")
HEADING = re.compile(r"^(#{1,6})\s+(.*?)\s*#*\s*$")
# [text](target "title"), with one pair of brackets in the text, as pictures in links have.
INLINE = re.compile(r"\[(?:[^\[\]]|\[[^\[\]]*\](?:\([^()]*\))?)*\]\(\s*<?([^()\s<>]+(?:\([^()\s]*\)[^()\s]*)?)>?(?:\s+\"[^\"]*\")?\s*\)")
PICTURE = re.compile(r"!\[[^\[\]]*\]\(\s*<?([^()\s<>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
DEFINITION = re.compile(r"^\s{0,3}\[[^\]]+\]:\s*<?([^\s>]+)>?")
HTML = re.compile(r"<(?:a|img)\b[^>]*?\b(?:href|src)\s*=\s*[\"']([^\"']+)[\"']", re.IGNORECASE)
ANCHOR = re.compile(r"<[a-z]+\b[^>]*?\b(?:id|name)\s*=\s*[\"']([^\"']+)[\"']", re.IGNORECASE)
SCHEME = re.compile(r"^(?:[a-z][a-z0-9+.-]*:|//)", re.IGNORECASE)


def prose(path):
    """Line numbers and lines outside of fenced code, their code spans left as they are."""
    fence = None
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        mark = FENCE.match(line)
        if fence:
            closes = mark and mark[1][0] == fence[0] and len(mark[1]) >= len(fence)
            if closes and not line[mark.end():].strip():
                fence = None
        elif mark:
            fence = mark[1]
        else:
            yield number, line


def without_code(line):
    """The line with its code spans blanked."""
    return re.sub(r"(`+)(?!`).*?(?<!`)\1(?!`)", lambda span: " " * len(span[0]), line)


def slug(heading):
    """The anchor that mdBook and GitHub give a heading."""
    text = re.sub(r"!?\[([^\[\]]*)\]\([^()]*\)", r"\1", heading)
    text = re.sub(r"[`*]", "", text).strip().lower()
    return "".join("-" if c.isspace() else c for c in text if c.isalnum() or c in "-_" or c.isspace())


def anchors(path, known={}):
    """The anchors of a page."""
    if path not in known:
        found, count = set(), {}
        for _, line in prose(path):
            found.update(ANCHOR.findall(without_code(line)))
            heading = HEADING.match(line)
            if heading:
                name = slug(heading[2])
                again = count.get(name, 0)
                count[name] = again + 1
                found.add(f"{name}-{again}" if again else name)
        known[path] = found
    return known[path]


def targets(line):
    """The targets of all links and pictures of a line."""
    line = without_code(line)
    for pattern in (INLINE, PICTURE, DEFINITION, HTML):
        yield from pattern.findall(line)


def fault(page, target):
    """What is wrong with a link, or None."""
    if SCHEME.match(target):
        return None
    place, _, anchor = target.partition("#")
    if place.startswith("/"):
        return "is no relative link"
    file = (page.parent / unquote(place)).resolve() if place else page
    if not file.exists():
        return "does not exist"
    if page.parent == BOOK and not file.is_relative_to(BOOK):
        return "is not in docs/src: the rendered book does not have it"
    if anchor and file.suffix == ".md" and unquote(anchor) not in anchors(file):
        return "has no such heading"
    return None


def main():
    pages = sorted(BOOK.glob("*.md")) + [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CHANGELOG.md")]
    pages = [page for page in pages if page.is_file()]
    dead, links, in_summary = [], 0, set()
    for page in pages:
        for number, line in prose(page):
            for target in dict.fromkeys(targets(line)):
                links += 1
                wrong = fault(page, target)
                if wrong:
                    dead.append(f"{page.relative_to(ROOT)}:{number}: {target} {wrong}")
                elif page.name == "SUMMARY.md":
                    in_summary.add((page.parent / target.partition("#")[0]).resolve())
    for page in sorted(BOOK.glob("*.md")):
        if page.name != "SUMMARY.md" and page not in in_summary:
            dead.append(f"{page.relative_to(ROOT)}: is not in SUMMARY.md")
    print(*dead, sep="\n", end="\n" if dead else "")
    print(f"{links} links in {len(pages)} pages, {len(dead)} dead")
    return 1 if dead else 0


if __name__ == "__main__":
    sys.exit(main())
