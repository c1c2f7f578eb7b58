"""Links to headings of a Markdown page, as GitHub and MyST make them."""

from __future__ import annotations

import re


def link_to(heading: str) -> str:
    """Return a link to a heading of the same page."""
    words = re.sub(r"[^\w\- ]", "", heading.lower())
    return f"[{heading}](#{words.replace(' ', '-')})"
