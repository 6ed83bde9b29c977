"""docs/benchmarks.md, one section for each script that measures."""

import os
import re

PATH = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "docs", "benchmarks.md"))
TITLE = "# Benchmarks\n"


def replace(heading, text):
    """Put `text` under `## heading`, in place of what is there; other sections stay."""
    page = TITLE
    if os.path.exists(PATH):
        with open(PATH, encoding="utf-8") as file:
            page = file.read()
    new = f"## {heading}\n\n{text.strip()}\n"
    pattern = re.compile(rf"^## {re.escape(heading)}\n.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)
    if pattern.search(page):
        page = pattern.sub(lambda found: new + ("\n" if found.end() < len(page) else ""), page)
    else:
        page = page.rstrip("\n") + "\n\n" + new
    with open(PATH, "w", encoding="utf-8") as file:
        file.write(page)
