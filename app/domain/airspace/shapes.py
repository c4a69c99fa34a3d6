"""shapely's shapes on the flat earth: `shapes.Point(place)`.

shapely brings NumPy, together 15 MB and 0.1 s of CPU time, so it is imported with the first shape, not at the start. On
the event loop, which has setpoints to send, no first shape may be made: a fence is made in a thread.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

__all__ = [
    "BaseGeometry",
    "LineString",
    "MultiPoint",
    "Point",
    "Polygon",
    "box",
    "get_parts",
    "intersection_all",
    "nearest_points",
    "orient",
    "prepare",
    "translate",
    "union_all",
]

if TYPE_CHECKING:
    from shapely import LineString, MultiPoint, Point, Polygon, box, get_parts, intersection_all, prepare, union_all
    from shapely.affinity import translate
    from shapely.geometry.base import BaseGeometry
    from shapely.geometry.polygon import orient
    from shapely.ops import nearest_points

_ELSEWHERE: Final = {
    "BaseGeometry": "shapely.geometry.base",
    "nearest_points": "shapely.ops",
    "orient": "shapely.geometry.polygon",
    "translate": "shapely.affinity",
}


def __getattr__(name: str) -> Any:
    """Called for a name's first use; then it is the module's own."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_ELSEWHERE.get(name, "shapely")), name)
    return found
