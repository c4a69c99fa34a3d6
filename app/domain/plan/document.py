"""The plan document, as a pydantic model."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field, field_validator
from pydantic_core import PydanticCustomError, PydanticKnownError

from app.domain.items import PlanItem
from app.domain.items.drop_places import Alternate
from app.domain.items.fields import (
    FROM_JSON,
    AbsoluteAltitudeM,
    LatitudeDeg,
    LongitudeDeg,
    PlanModel,
    Point,
    Position,
    SpeedMS,
)
from app.domain.plan.json_tree import MAX_ITEMS, MAX_POLYGONS, MAX_RALLY_POINTS, MAX_VERTICES
from app.domain.validation.finding import json_pointer
from app.domain.validation.plain_text import PLAIN_LINE, PLAIN_NAME, PLAIN_TEXT
from app.domain.vehicle.state import VehicleType

FenceKind = Literal["inclusion", "exclusion"]


class FencePolygon(PlanModel):
    """At least three corners, in order. Do not repeat the first corner. Edges are straight in latitude and longitude,
    and must not cross the antimeridian.
    """

    kind: FenceKind
    vertices: Annotated[tuple[Point, ...], FROM_JSON, Field(min_length=3, max_length=MAX_VERTICES, fail_fast=True)]


class FenceCircle(PlanModel):
    """A circle to stay inside or outside."""

    kind: FenceKind
    latitude_deg: LatitudeDeg
    longitude_deg: LongitudeDeg
    radius_m: Annotated[float, Field(gt=0, le=100_000)]


class Geofence(PlanModel):
    """Positions inside any inclusion (anywhere if there is none) and outside all exclusions are allowed."""

    polygons: Annotated[tuple[FencePolygon, ...], FROM_JSON, Field(max_length=MAX_POLYGONS)] = ()
    circles: Annotated[tuple[FenceCircle, ...], FROM_JSON, Field(max_length=MAX_POLYGONS)] = ()


class RallyPoint(Position):
    """A place that the vehicle may return to instead of home."""


ALTERNATE_SUFFIX: Final = "-alternate"
MAX_ID_LENGTH: Final = 48
"""Maximum length of a generated ID. It is shorter than 64, so that a suffix can make it unique."""


class Home(PlanModel):
    """The expected start position. If the vehicle reports a home position, that one is used instead."""

    latitude_deg: LatitudeDeg
    longitude_deg: LongitudeDeg
    absolute_altitude_m: AbsoluteAltitudeM


class Order(PlanModel):
    """The delivery order, a reference of the dispatch system. Waydrop only stores it."""

    id: Annotated[str, Field(min_length=1, max_length=200), PLAIN_NAME]
    recipient: Annotated[str, Field(max_length=500), PLAIN_LINE] | None = None
    notes: Annotated[str, Field(max_length=500), PLAIN_TEXT] | None = None


class Limits(PlanModel):
    """Limits of the plan itself, checked by rules.

    `min_battery_percent` must be left at the end of the flight. A vehicle may declare a higher reserve.
    """

    max_relative_altitude_m: Annotated[float, Field(gt=0, le=20_000)] | None = None
    max_distance_m: Annotated[float, Field(gt=0, le=1_000_000)] | None = None
    max_speed_m_s: SpeedMS | None = None
    max_drop_height_m: Annotated[float, Field(gt=0, le=20_000)] | None = None
    max_duration_s: Annotated[float, Field(gt=0, le=604_800)] | None = None
    min_battery_percent: Annotated[float, Field(ge=0, lt=100)] | None = None


class Contingency(PlanModel):
    """What the plan expects when something fails. `on_link_loss` is compared with the vehicle's NAV_DLL_ACT."""

    on_drop_failure: Literal["continue", "return", "hold"] = "continue"
    on_link_loss: Literal["continue", "hold", "return", "land"] | None = None


def _version(value: object) -> object:
    if isinstance(value, bool):  # True equals 1
        raise PydanticKnownError("literal_error", {"expected": "1"})
    return value


class Plan(PlanModel):
    """A delivery plan, version 1. Items without an ID get `item-<number>`. IDs are unique."""

    version: Annotated[Literal[1], BeforeValidator(_version)]
    name: Annotated[str, Field(min_length=1, max_length=200), PLAIN_NAME]
    vehicle_type: Annotated[VehicleType, FROM_JSON]
    items: Annotated[
        tuple[Annotated[PlanItem, Field(discriminator="type")], ...],
        FROM_JSON,
        Field(min_length=1, max_length=MAX_ITEMS),
    ]
    home: Home | None = None
    cruise_speed_m_s: SpeedMS | None = None
    order: Order | None = None
    limits: Limits = Limits()
    contingency: Contingency = Contingency()
    geofence: Geofence = Geofence()
    rally_points: Annotated[tuple[RallyPoint, ...], FROM_JSON, Field(max_length=MAX_RALLY_POINTS)] = ()

    @field_validator("items")
    @classmethod
    def _unique_ids(cls, items: tuple[PlanItem, ...]) -> tuple[PlanItem, ...]:
        taken: set[str] = set()
        for index, item in enumerate(items):
            _take(taken, item.id, "items", index, "id")
            if (alternate := item.other_place()) is not None:
                _take(taken, alternate.id, "items", index, "alternate", "id")
        named = [
            item if item.id else item.model_copy(update={"id": _free_id(f"item-{number}", taken)})
            for number, item in enumerate(items, start=1)
        ]
        return tuple([_with_alternate_named(item, taken) for item in named])

    @property
    def alternates(self) -> tuple[tuple[PlanItem, Alternate], ...]:
        """Return the drops with an alternate, and their alternates."""
        return tuple([(item, there) for item in self.items if (there := item.other_place()) is not None])

    def index_of(self, item_id: str) -> int | None:
        return next((index for index, item in enumerate(self.items) if item.id == item_id), None)


def _take(taken: set[str], name: str, *path: str | int) -> None:
    if name and name in taken:
        raise PydanticCustomError(
            "duplicate_id",
            "the id {id} is already used by an earlier item",
            {"id": name, "pointer": json_pointer(*path)},
        )
    taken.add(name)


def _with_alternate_named(item: PlanItem, taken: set[str]) -> PlanItem:
    if (alternate := item.other_place()) is None or alternate.id:
        return item
    name = _free_id(item.id[: MAX_ID_LENGTH - len(ALTERNATE_SUFFIX)] + ALTERNATE_SUFFIX, taken)
    return item.model_copy(update={"alternate": alternate.model_copy(update={"id": name})})


def _free_id(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "x"
    taken.add(name)
    return name


def plan_hash(plan: Plan) -> str:
    """Return the SHA-256 (hex) of the plan's canonical JSON: sorted keys, no spaces, explicit defaults."""
    return document_hash(plan.model_dump(mode="json"))


def document_hash(document: Mapping[str, Any]) -> str:
    """Return the hash of a plan document as stored, by any version of Waydrop."""
    canonical = json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    return hashlib.sha256(canonical.encode("utf-8", "surrogatepass")).hexdigest()
