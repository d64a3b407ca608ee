"""Reports: figures of a result, and a page that holds them."""

from ..errors import MissingExtraError

try:
    import jinja2 as _jinja2  # noqa: F401
    import plotly as _plotly  # noqa: F401
except ImportError as problem:
    raise MissingExtraError("reports need plotly and jinja2: pip install 'gainful[report]'") from problem

from .figures import figures_of
from .gallery import Card, Missing, make_card, write_gallery
from .html import Judgement, Table, write_report
from .identification import write_identification_report
from .network import write_network_report
from .panels import Section
from .study import write_study_report

__all__ = [
    "Card",
    "Judgement",
    "Missing",
    "Section",
    "Table",
    "figures_of",
    "make_card",
    "write_gallery",
    "write_identification_report",
    "write_network_report",
    "write_report",
    "write_study_report",
]
