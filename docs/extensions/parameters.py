"""The directive ``parameters``: a table of fields of a parameter class, with defaults read from the code."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import re
from typing import Any

import numpydoc.docscrape
from docutils import nodes
from docutils.parsers.rst import Directive, directives
from docutils.statemachine import StringList
from sphinx.application import Sphinx


def descriptions(text: str | None, section: str) -> dict[str, list[str]]:
    """Return what a NumPy docstring says of each name in one of its sections."""
    found: dict[str, list[str]] = {}
    for entry in numpydoc.docscrape.NumpyDocString(inspect.cleandoc(text or ""))[section]:
        for name in entry.name.split(", "):
            found[name] = entry.desc
        if entry.name.startswith("**"):  # keywords, described as a list of their own
            rest = "\n".join(entry.desc[1:])
            found |= descriptions(f"\n\n{section}\n{'-' * len(section)}\n{inspect.cleandoc(rest)}", section)
    return found


class Parameters(Directive):
    """
    A table of the fields of a dataclass.

    The argument is the class, the content the names of its fields, all where there is none. ``:prefix:``
    is what ``--set`` writes before a name; ``:described-by:`` names a function whose docstring has the
    descriptions.
    """

    required_arguments = 1
    has_content = True
    option_spec = {"prefix": directives.unchanged, "described-by": directives.unchanged}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """Make the table."""
        owner = load(self.arguments[0])
        defaults = owner()
        known = [field.name for field in dataclasses.fields(owner)]
        names = " ".join(self.content).split() or known
        described_by = self.options.get("described-by")
        if described_by:
            said = descriptions(load(described_by).__doc__, "Parameters")
        else:
            said = descriptions(owner.__doc__, "Attributes")
        prefix = self.options.get("prefix", "")
        lines = ["| parameter | default | |", "|---|---|---|"]
        for name in names:
            if name not in known or name not in said:
                raise self.error(f"{self.arguments[0]} has no described field {name!r}")
            default = getattr(defaults, name)
            lines.append(f"| `{prefix}{name}` | `{default!r}` | {markdown(' '.join(said[name]))} |")
        node = nodes.container()
        self.state.nested_parse(StringList(lines, source="parameters"), self.content_offset, node)
        return node.children


def markdown(text: str) -> str:
    """Return a line of a docstring as Markdown in a table."""
    roles = re.sub(r":(\w+):`([^`]+)`", r"{py:\1}`\2`", text)
    return re.sub(r" \[\d\]_", "", roles).replace("|", "\\|")


def load(path: str) -> Any:
    """Return what a dotted name stands for."""
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(module), name)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("parameters", Parameters)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
