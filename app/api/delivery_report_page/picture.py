"""The maps of a delivery report: SVG drawn from the plan and the measured release points."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final

from app.domain.drop.record import DropRecord
from app.domain.geo import LocalProjection

Point = tuple[float, float]
WIDTH: Final = 640.0
HEIGHT: Final = 400.0
_MARGIN: Final = 36.0
_SCALE_BARS_M: Final = tuple(step * 10.0**power for power in range(-1, 6) for step in (1, 2, 5))


@dataclass(frozen=True, slots=True)
class View:
    """Maps east and north metres to SVG units. North is up."""

    middle: Point
    units_per_m: float

    @classmethod
    def of(cls, points: Sequence[Point], smallest_m: float) -> View:
        """Return a view that contains all points and is at least `smallest_m` wide and high."""
        east, north = [point[0] for point in points], [point[1] for point in points]
        high = (HEIGHT - 2.0 * _MARGIN) / max(max(north) - min(north), smallest_m)
        middle = ((max(east) + min(east)) / 2.0, (max(north) + min(north)) / 2.0)
        return cls(middle, min(high, (WIDTH - 2.0 * _MARGIN) / max(max(east) - min(east), smallest_m)))

    def at(self, point: Point) -> Point:
        """Project a position to SVG coordinates."""
        x = WIDTH / 2.0 + (point[0] - self.middle[0]) * self.units_per_m
        return x, HEIGHT / 2.0 - (point[1] - self.middle[1]) * self.units_per_m


def overview(plan: dict[str, Any], drops: Sequence[DropRecord]) -> str | None:
    """Draw the whole route with fences and drops. Returns None for a plan without positions."""
    route = _places(plan.get("items", ()))
    home = _places([plan.get("home") or {}])
    around = [*home, *route, *(place for drop in drops for place in _drop_places(drop))]
    if not around:
        return None
    frame = LocalProjection(*around[0])
    view = View.of([frame.to_local(*place) for place in around], 50.0)
    shapes = [*_fences(plan, frame, view), _line([frame.to_local(*place) for place in [*home, *route]], view, "route")]
    shapes += [_dot(view.at(frame.to_local(*place)), 3.0, "place") for place in [*home, *route]]
    for drop in drops:
        shapes += _drop(drop, frame, view)
    return _svg([*shapes, _scale(view)], "Map of the route, fences and drops")


def close_up(drop: DropRecord) -> str | None:
    """Draw the planned and the measured point of one drop. Returns None unless both are known."""
    places = _drop_places(drop)
    if len(places) < 2:
        return None
    frame = LocalProjection(*places[0])
    release = frame.to_local(*places[1])
    view = View((0.0, 0.0), (HEIGHT / 2.0 - _MARGIN) / max(2.0, 1.2 * math.hypot(*release)))
    line = _line([(0.0, 0.0), release], view, "offset")
    return _svg(
        [line, *_drop(drop, frame, view), _scale(view)], f"Release of {drop.plan_item_id} and its planned point"
    )


def _places(parts: Iterable[dict[str, Any]]) -> list[Point]:
    pairs = ((part.get("latitude_deg"), part.get("longitude_deg")) for part in parts)
    return [(lat, lon) for lat, lon in pairs if isinstance(lat, int | float) and isinstance(lon, int | float)]


def _drop_places(drop: DropRecord) -> list[Point]:
    """Return the planned and the measured point, as far as they are known."""
    pairs = (
        (drop.planned_latitude_deg, drop.planned_longitude_deg),
        (drop.latitude_deg, drop.longitude_deg),
    )
    return [(lat, lon) for lat, lon in pairs if lat is not None and lon is not None]


def _drop(drop: DropRecord, frame: LocalProjection, view: View) -> list[str]:
    shapes: list[str] = []
    if drop.planned_latitude_deg is not None and drop.planned_longitude_deg is not None:
        x, y = view.at(frame.to_local(drop.planned_latitude_deg, drop.planned_longitude_deg))
        shapes.append(_dot((x, y), 9.0, "planned"))
        shapes.append(f'<text x="{x + 13:.1f}" y="{y - 9:.1f}">{escape(drop.plan_item_id)}</text>')
    if drop.latitude_deg is not None and drop.longitude_deg is not None:
        shapes.append(_dot(view.at(frame.to_local(drop.latitude_deg, drop.longitude_deg)), 4.5, "release"))
    return shapes


def _fences(plan: dict[str, Any], frame: LocalProjection, view: View) -> list[str]:
    fence = plan.get("geofence") or {}
    shapes: list[str] = []
    for polygon in fence.get("polygons", ()):
        corners = [view.at(frame.to_local(*place)) for place in _places(polygon.get("vertices", ()))]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
        shapes.append(f'<polygon class="{_kind(polygon)}" points="{points}"/>')
    for circle in fence.get("circles", ()):
        radius = float(circle.get("radius_m", 0.0)) * view.units_per_m
        shapes += [_dot(view.at(frame.to_local(*place)), radius, _kind(circle)) for place in _places([circle])]
    return shapes


def _kind(area: dict[str, Any]) -> str:
    return "keep-out" if area.get("kind") == "exclusion" else "keep-in"


def _line(points: Sequence[Point], view: View, kind: str) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(view.at, points))
    return f'<polyline class="{kind}" points="{path}"/>'


def _dot(at: Point, radius: float, kind: str) -> str:
    return f'<circle class="{kind}" cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:.1f}"/>'


def _scale(view: View) -> str:
    longest_m = max((m for m in _SCALE_BARS_M if m * view.units_per_m <= WIDTH / 4.0), default=_SCALE_BARS_M[0])
    length, y = longest_m * view.units_per_m, HEIGHT - 14.0
    text = f"{longest_m / 1000.0:g} km" if longest_m >= 1000.0 else f"{longest_m:g} m"
    return (
        f'<path class="scale" d="M14,{y - 5} V{y} H{14 + length:.1f} V{y - 5}"/>'
        f'<text x="{20 + length:.1f}" y="{y}">{text}</text>'
        f'<text class="north" x="{WIDTH - 24}" y="24">N ↑</text>'
    )


def _svg(shapes: Sequence[str], title: str) -> str:
    return (
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img"><title>{escape(title)}</title>'
        f'<rect class="ground" width="{WIDTH:g}" height="{HEIGHT:g}"/>{"".join(shapes)}</svg>'
    )
