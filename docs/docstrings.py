"""How the docstrings of parts become pages: doctests as code, sources as paragraphs."""

import re
from typing import Any

import griffe

_NOTE = re.compile(r"^(Source|Differs|Reduces to): (.*(?:\n[ ]{4,}\S.*)*)\n?", re.M)


def _paragraph(found: re.Match[str]) -> str:
    return f"\n**{found[1]}:** {' '.join(found[2].split())}\n"


class Docstrings(griffe.Extension):
    """Rewrites the sections that the Google style does not know."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Called once for every module, class, function and attribute."""
        if obj.docstring is not None:
            text = re.sub(r"^Example:$", "Examples:", obj.docstring.value, flags=re.M)
            obj.docstring.value = _NOTE.sub(_paragraph, text)
