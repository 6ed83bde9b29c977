"""Pages of docs/, one section for each script that measures; docs/benchmarks.md unless told."""

import os
import re

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
PATH = os.path.join(ROOT, "docs", "benchmarks.md")
TITLE = "# Benchmarks\n"


def replace(heading, text, path=PATH, title=TITLE):
    """Put `text` under `## heading`, in place of what is there; other sections stay."""
    page = title
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            page = file.read()
    new = f"## {heading}\n\n{text.strip()}\n"
    pattern = re.compile(rf"^## {re.escape(heading)}\n.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)
    if pattern.search(page):
        page = pattern.sub(lambda found: new + ("\n" if found.end() < len(page) else ""), page)
    else:
        page = page.rstrip("\n") + "\n\n" + new
    with open(path, "w", encoding="utf-8") as file:
        file.write(page)
