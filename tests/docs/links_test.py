#!/usr/bin/env python3
"""Links of the documentation lead somewhere, headings included, and generated pages are what the program says.

usage: links_test.py RCSPLAT [--update]    --update writes the generated pages
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[2]
COMMANDS = ROOT / "docs/commands.md"


def headings(page):
    """Anchors as GitHub and MkDocs make them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    for title in re.findall(r"^#+ (.*)", text, re.M):
        yield re.sub(r"[\s]", "-", re.sub(r"[^\w\s-]", "", title.strip().lower()))


def broken_links(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        other = (page.parent / path).resolve() if path else page
        if not other.exists():
            yield f"{page.relative_to(ROOT)}: {target} does not exist"
        elif anchor and other.suffix == ".md" and anchor not in set(headings(other)):
            yield f"{page.relative_to(ROOT)}: {target} has no such heading"


def main():
    said = subprocess.run([sys.argv[1], "manual", "--markdown"], check=True, capture_output=True, text=True,
                          env={"HOME": "/", "XDG_RUNTIME_DIR": "/run"}).stdout
    if "--update" in sys.argv:
        COMMANDS.write_text(said)
    wrong = [] if COMMANDS.exists() and COMMANDS.read_text() == said else [
        "docs/commands.md is not what the program says: tests/docs/links_test.py RCSPLAT --update"]
    pages = [ROOT / "README.md", ROOT / "shaders/README.md", *sorted((ROOT / "docs").glob("*.md")),
             *sorted((ROOT / "service/python").glob("*.md"))]
    for page in pages:
        wrong += broken_links(page)
    print("\n".join(wrong) or f"{len(pages)} pages, every link resolves")
    return 1 if wrong else 0


sys.exit(main())
