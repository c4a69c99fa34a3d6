"""The geofence and the rally points of a plan."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.domain.items.fields import FROM_JSON, LatitudeDeg, LongitudeDeg, PlanModel, Point, Position
from app.domain.plan.size_limits import MAX_POLYGONS, MAX_VERTICES

FenceKind = Literal["inclusion", "exclusion"]


class FencePolygon(PlanModel):
    """At least three corners, in order, the first not repeated. Edges are the short way round."""

    kind: FenceKind
    vertices: Annotated[tuple[Point, ...], FROM_JSON, Field(min_length=3, max_length=MAX_VERTICES, fail_fast=True)]


class FenceCircle(PlanModel):
    """A circle to stay in or out of."""

    kind: FenceKind
    latitude_deg: LatitudeDeg
    longitude_deg: LongitudeDeg
    radius_m: Annotated[float, Field(gt=0, le=100_000)]


class Geofence(PlanModel):
    """Allowed is what lies in any inclusion (everywhere if there is none) and in no exclusion."""

    polygons: Annotated[tuple[FencePolygon, ...], FROM_JSON, Field(max_length=MAX_POLYGONS)] = ()
    circles: Annotated[tuple[FenceCircle, ...], FROM_JSON, Field(max_length=MAX_POLYGONS)] = ()


class RallyPoint(Position):
    """A place the vehicle may return to instead of home."""
