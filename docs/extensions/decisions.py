"""The directive ``decisions``: tables of the numbers that decide, read from each folder's ``limits.hpp``."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from limit_lines import SOURCES, numbers_of
from sphinx.application import Sphinx


class Decisions(Directive):
    """A heading and a table for each folder that has a ``limits.hpp``."""

    def run(self) -> list[nodes.Node]:
        """Make the tables."""
        lines = []
        for header in sorted(SOURCES.glob("*/limits.hpp")):
            lines += [f"**{header.parent.name}** (`cpp/src/{header.parent.name}/limits.hpp`)", ""]
            lines += ["| number | value | kind | what it decides | guarded by |", "|---|---|---|---|---|"]
            for number in numbers_of(header):
                value = f"{number.value.rstrip('F')} {number.unit}".removesuffix(" 1")
                cells = (f"`{number.name}`", value, number.kind, number.meaning, number.guard)
                lines.append("| " + " | ".join(cells) + " |")
            lines.append("")
        node = nodes.container()
        self.state.nested_parse(StringList(lines, source="decisions"), self.content_offset, node)
        return node.children


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("decisions", Decisions)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
