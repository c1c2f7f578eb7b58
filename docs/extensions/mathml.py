"""Equations as MathML, written when the pages are built: they need neither a script nor the network."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

BOLD = {chr(ord("a") + i): chr(0x1D41A + i) for i in range(26)} | {
    chr(ord("A") + i): chr(0x1D400 + i) for i in range(26)
}
SCRIPT = {"R": "\N{SCRIPT CAPITAL R}"}


def mathml(latex: str, display: str) -> str:
    """Return an equation as MathML Core, which browsers draw: letters in place of their variants."""
    # Names of parameters are words.
    words = re.sub(r"\\mathtt\{([^}]*)\}", lambda m: rf"\text{{{m[1]}}}".replace(r"\_", "_"), latex)
    text = convert(words, display=display)
    text = re.sub(r'<mi mathvariant="bold">(\w)</mi>', lambda m: f"<mi>{BOLD[m[1]]}</mi>", text)
    return re.sub(r'<mi mathvariant="script">(\w)</mi>', lambda m: f"<mi>{SCRIPT[m[1]]}</mi>", text)


def inline(translator: Any, node: nodes.math) -> None:
    """Write an equation within a line."""
    translator.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def block(translator: Any, node: nodes.math_block) -> None:
    """Write an equation on lines of its own."""
    translator.body.append(f'<div style="margin: 1em 0">{mathml(node.astext(), "block")}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer under the name ``mathml``."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
