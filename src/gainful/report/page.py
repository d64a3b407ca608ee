"""What every page shares: templates, cells, figures as data, and how a file is put in its place."""

from __future__ import annotations

import contextlib
import itertools
import math
import os
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
import plotly.io
import plotly.offline
from markupsafe import Markup

from ..studies import Measured
from .panels import FONT, Section


def page_text(template: str, sections: Sequence[Section], **given: Any) -> str:
    """A page with its figures, complete in itself.

    Args:
        template: name of its file, without ".html.jinja".
        sections: the figures, in the order they are read.
        given: what else the template asks for.
    """
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=jinja2.FunctionLoader(_part),
    )
    environment.filters |= {
        "cell": cell,
        "heading": heading,
        "sentence": lambda text: text[:1].upper() + text[1:].replace("-", " "),
        "unbroken": lambda text: text.replace(" %", "\N{NO-BREAK SPACE}%"),
    }
    groups = [(head, list(group)) for head, group in itertools.groupby(sections, lambda section: section.title)]
    return environment.get_template(f"{template}.html.jinja").render(
        groups=groups,
        anchor=lambda text: "section-" + "".join(c if c.isalnum() else "-" for c in text.lower()),
        figure=_figure_data,
        font=Markup(FONT),
        css=Markup(_part("report.css")),
        script=Markup(_part("report.js")),
        plotly=Markup(plotly.offline.get_plotlyjs()),
        **given,
    )


def _part(name: str) -> str:
    return resources.files("gainful.report").joinpath(name).read_text(encoding="utf-8")


def _figure_data(section: Section) -> Markup:
    """A figure as JSON that cannot end the script element it stands in."""
    text = plotly.io.to_json(section.figure, validate=False)
    assert text is not None
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def cell(value: Any, column: str = "") -> str:
    """A table's cell in words: numbers to four digits, whole numbers with their thousands apart, a dash for none.

    Shares are told in per cent where the heading of their column speaks of it.
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "\N{EN DASH}"
    if isinstance(value, (str, bool)):
        return str(value)
    if isinstance(value, Measured):
        return value.number.replace(" ", "\N{NO-BREAK SPACE}")
    if isinstance(value, int):
        return f"{value:,}"
    number = float(value)
    if "%" in column:
        return f"{100 * number:.1f}\N{NO-BREAK SPACE}%"
    return f"{number:,.0f}" if 1e4 <= abs(number) < 1e7 else f"{number:.4g}"


def heading(column: str) -> str:
    """A column's heading as a sentence begins, unless it begins with a name that is a user's own.

    Example:
        >>> heading("last sigma"), heading("r run by itself"), heading("linear_drag")
        ('Last sigma', 'r run by itself', 'linear_drag')
    """
    first = column.partition(" ")[0].rstrip(",")
    return column[:1].upper() + column[1:] if len(first) > 1 and first.isalpha() else column


def write_page(path: Path, text: str) -> None:
    """Write beside the file, then put it in its place in one step."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
