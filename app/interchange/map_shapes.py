"""Shapes on the map in longitude and latitude: circles as rings, and what crosses the antimeridian cut there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from app.domain.airspace import shapes
from app.domain.geo import EARTH_RADIUS_M, destination_deg, distance_m

Coordinate = tuple[float, float]
"""(longitude_deg, latitude_deg), the order of GeoJSON and KML."""

_CIRCLE_POINTS: Final = 64
_WORLDS: Final = (-360.0, 0.0, 360.0)
_POLE_DEG: Final = 90.0


def circle_ring(latitude_deg: float, longitude_deg: float, radius_m: float) -> tuple[Coordinate, ...] | None:
    """A circle as a ring, not closed. None if a pole lies in it: no ring on a flat map can show that."""
    to_pole_m = min(distance_m(latitude_deg, longitude_deg, pole, longitude_deg) for pole in (_POLE_DEG, -_POLE_DEG))
    if radius_m >= to_pole_m or radius_m >= EARTH_RADIUS_M:
        return None
    turns = (360.0 * index / _CIRCLE_POINTS for index in range(_CIRCLE_POINTS))
    places = (destination_deg(latitude_deg, longitude_deg, turn, radius_m) for turn in turns)
    return tuple((longitude, latitude) for latitude, longitude in places)


def line_parts(line: Sequence[Coordinate]) -> list[list[Coordinate]]:
    """The line the short way round, in as many parts as it needs. One place alone makes no line: an empty list."""
    shape = shapes.LineString(_unrolled(line)) if len(line) > 1 else shapes.LineString()
    return [_flat(part.coords) for part in _cut(shape) if isinstance(part, shapes.LineString) and part.length > 0]


def polygon_parts(ring: Sequence[Coordinate]) -> list[list[Coordinate]]:
    """The rings of the area, closed, counter-clockwise (RFC 7946). A ring that crosses itself stays as it is."""
    shape = shapes.Polygon(_unrolled(ring))
    if not shape.is_valid:
        return [[*ring, ring[0]]]
    parts = (part for part in _cut(shape) if isinstance(part, shapes.Polygon) and not part.is_empty)
    return [_flat(shapes.orient(part).exterior.coords) for part in parts]


def _flat(coordinates: Iterable[Sequence[float]]) -> list[Coordinate]:
    return [(point[0], point[1]) for point in coordinates]


def _unrolled(line: Sequence[Coordinate]) -> list[Coordinate]:
    """Without jumps of more than half a turn: longitudes may leave -180 to 180."""
    made = [line[0]]
    for longitude, latitude in line[1:]:
        step = (longitude - made[-1][0] + 180.0) % 360.0 - 180.0
        near = abs(longitude - made[-1][0]) <= 180.0
        made.append((longitude if near else made[-1][0] + step, latitude))
    return made


def _cut(shape: shapes.BaseGeometry) -> list[shapes.BaseGeometry]:
    """The parts in each turn of the world, moved back into -180 to 180. Untouched if it stays within one."""
    if shape.is_empty:
        return []
    west, _, east, _ = shape.bounds
    if west >= -180.0 and east <= 180.0:
        return [shape]
    found: list[shapes.BaseGeometry] = []
    for turn in _WORLDS:
        part = shape.intersection(shapes.box(turn - 180.0, -_POLE_DEG, turn + 180.0, _POLE_DEG))
        found += [shapes.translate(piece, xoff=-turn) for piece in getattr(part, "geoms", [part]) if not piece.is_empty]
    return found
