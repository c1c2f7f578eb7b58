"""The page: one self-contained HTML file."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Sequence
from html import escape
from pathlib import Path

from nacre import __version__
from nacre.errors import printable
from nacre.io.atomic import atomic_writer
from nacre.report.charts import status_strip
from nacre.report.data import ReportData
from nacre.report.frame_sections import frames_section, time_section, trajectory_section
from nacre.report.pictures import ModelPictures, draw_model
from nacre.report.reported_frame import ReportedFrame
from nacre.report.sections import depth_section, funnel_section, model_section
from nacre.report.summary import Summary, summarize
from nacre.report.tables import attention_section, figures_section, frames_table_section, parameters_section
from nacre.report.text import count, ranges
from nacre.report.verdict import Verdict


def write_report(path: str | os.PathLike[str], data: ReportData) -> None:
    """
    Write a reconstruction's report: one HTML file with its pictures inside, without network or script.

    Parameters
    ----------
    path : path-like
        The file to write, usually ``report.html``; its folder must exist. It appears only when it is
        complete.
    data : ReportData
        What to show. Whatever is missing is left out.

    Notes
    -----
    The same data gives the same bytes, 3 MB at most for any number of frames and points. Errors of the poses
    are worked out from ``frames`` where ``evaluation`` holds no trajectory error.
    """
    page = render_page(data)
    with atomic_writer(path) as stream:
        stream.write(page.encode())


def render_page(data: ReportData) -> str:
    """Return the report as HTML text."""
    summary = summarize(data)
    model = draw_model(data.model, data.frames) if data.model is not None else None
    sections = [
        attention_section(data.frames),
        model_section(model),
        depth_section(data.depth, data.frames),
        funnel_section(data.frames),
        trajectory_section(data.frames, summary.trajectory),
        frames_section(data.frames, data.parameters),
        time_section(data.frames),
        figures_section(data, summary),
        frames_table_section(data.frames),
        parameters_section(data),
    ]
    body = "\n".join(f"<section>{section}</section>" for section in sections if section)
    style = Path(__file__).with_name("style.css").read_text(encoding="utf-8")
    return printable(
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(data.title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        f"{_header(data, summary, model)}\n{_contents(body)}\n{body}\n"
        f"<footer>Made by nacre {escape(__version__)}. Poses are camera to world; the world is the "
        "first camera's frame.</footer>\n</main>\n</body>\n</html>\n"
    )


def _header(data: ReportData, summary: Summary, model: ModelPictures | None) -> str:
    tiles = "".join(
        f"<div><dt>{escape(tile.label)}</dt><dd>{escape(tile.value)}"
        + (f"<small>{escape(tile.note)}</small>" if tile.note else "")
        + "</dd></div>"
        for tile in summary.tiles
    )
    picture = ""
    if model:
        main = model.main
        alt = f"The model of {data.title}, shaded grey"
        picture = (
            f'<img src="{main.uri}" width="{main.size[0]}" height="{main.size[1]}" data-name="the-model" '
            f'alt="{escape(alt, quote=True)}">'
        )
    source = f'<p class="source">{escape(data.source)}</p>' if data.source else ""
    return (
        f'<header class="intro{"" if model else " alone"}"><div><p class="brand">nacre reconstruction</p>'
        f"<h1>{escape(data.title)}</h1>{source}{_verdict(summary.verdict, summary.sentence)}"
        f'<dl class="tiles">{tiles}</dl></div>{picture}</header>{_strip(data.frames)}'
    )


def _verdict(verdict: Verdict | None, sentence: str) -> str:
    if verdict is None:
        return f'<p class="verdict">{escape(sentence)}</p>' if sentence else ""
    step = f'<p class="next">{escape(verdict.next_step)}</p>' if verdict.next_step else ""
    return (
        f'<div class="verdict {verdict.level}"><p class="word">{escape(verdict.word)}</p>'
        f"<p>{escape(sentence)}</p>{step}</div>"
    )


def _strip(frames: Sequence[ReportedFrame]) -> str:
    """Return the states of all frames as a bar, in the order in which they came."""
    if len(frames) < 2:
        return ""
    states = [frame.status.upper() for frame in frames]
    counts = Counter(states)
    shown = [name for name in ("TRACKED", "RELOCALISED", "WEAK", "LOST") if counts[name]]
    told = "".join(
        f'<span class="key"><i class="k-{name.lower()} full"></i>{count(counts[name])} {name}</span>'
        for name in shown
    )
    lost = [frame.index for frame in frames if frame.status.upper() == "LOST"]
    alt = ", ".join(f"{counts[name]} {name}" for name in shown) + (f"; lost: {ranges(lost)}" if lost else "")
    first, last = frames[0].index, frames[-1].index
    return (
        f'<div class="states">{status_strip(states, f"State of every frame: {alt}")}'
        f'<p class="note"><span>frame {first}</span><span>{told}</span><span>{last}</span></p></div>'
    )


def _contents(body: str) -> str:
    """Return links to the page's sections."""
    found = re.findall(r'<h2 id="([\w-]+)">([^<]+)</h2>', body)
    links = "".join(f'<a href="#{name}">{text}</a>' for name, text in found)
    return f'<nav aria-label="Sections">{links}</nav>' if len(found) > 2 else ""
