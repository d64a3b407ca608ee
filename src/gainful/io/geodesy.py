"""Geodetic columns in metres."""

from __future__ import annotations

import numpy as np

from ..errors import ConfigError, DataError, MissingExtraError
from .source import LocalFrame
from .tables import Table


def add_local_columns(table: Table, frame: LocalFrame) -> Table:
    """The table with `east`, `north` and `up` [m] in the tangent plane (WGS 84) at the frame's origin."""
    try:
        import pymap3d
    except ImportError as problem:
        raise MissingExtraError("latitudes need pymap3d: pip install 'gainful[io]'") from problem
    taken = [name for name in ("east", "north", "up") if name in table.columns]
    if taken:
        raise DataError(
            f"{table.path.name}: column {taken[0]!r} is there already, and would be made from {frame.latitude!r}"
        )
    latitude, longitude = table.numbers(frame.latitude), table.numbers(frame.longitude)
    for name, values, limit in ((frame.latitude, latitude, 90.0), (frame.longitude, longitude, 360.0)):
        far = np.flatnonzero(np.abs(values) > limit)
        if far.size:
            k = int(far[0])
            raise DataError(
                f"{table.path.name}: column {name!r} expected degrees up to {limit:g}, got {values[k]:.9g} "
                f"in {table.row(k)} ({far.size} such rows)"
            )
    height = table.numbers(frame.height) if frame.height else np.zeros_like(latitude)
    origin = frame.origin
    if not origin:
        first = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(height))
        if not first.size:
            raise DataError(f"{table.path.name}: no row with a whole position to take as the origin")
        origin = [latitude[first[0]], longitude[first[0]], height[first[0]]]
    if len(origin) != 3 or not abs(origin[0]) <= 90.0:
        raise ConfigError(f"origin: expected latitude [deg], longitude [deg] and height [m], got {origin}")
    lat0, lon0, height0 = origin
    east, north, up = pymap3d.geodetic2enu(latitude, longitude, height, lat0, lon0, height0)
    return Table(table.path, table.frame.assign(east=east, north=north, up=up))
