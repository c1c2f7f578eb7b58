"""Jinja templates as the report uses them: what they show is escaped."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.pictures.colormap import CATEGORIES
from nacre.report.color_bar import color_bar
from nacre.run_data.text import count, label, quantity

if TYPE_CHECKING:
    import jinja2


def render(template: str, **content: Any) -> str:
    """
    Return what a file of ``templates/`` makes of its content.

    Raises
    ------
    ImportError
        When jinja2 is missing, with the command that installs it.
    """
    return _environment().get_template(template).render(content)


@functools.cache
def _environment() -> jinja2.Environment:
    try:
        import jinja2
    except ImportError as error:
        message = 'the report (--no-report leaves it out) needs jinja2: pip install "nacre[report]"'
        raise ImportError(message, name="jinja2") from error
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).with_name("templates")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"count": count, "label": label, "quantity": quantity, "slug": _slug}
    environment.globals |= {"color_bar": color_bar, "CATEGORIES": CATEGORIES}
    return environment


def _slug(text: str) -> str:
    """Return words as a name for a file."""
    return re.sub(r"\W+", "-", text.lower()).strip("-")
