"""Filtering a stream, sample by sample."""

from .online import OnlineEstimate, OnlineFilter

__all__ = ["OnlineEstimate", "OnlineFilter"]
