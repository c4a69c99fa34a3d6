"""Field types shared by parts of a plan, and the base class of its models."""

from __future__ import annotations

from typing import Annotated, Final, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict, model_validator
from pydantic_core import PydanticCustomError

from app.domain.vehicle.state import GlobalPosition

LatitudeDeg = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False, description="WGS84 latitude")]
LongitudeDeg = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False, description="WGS84 longitude")]
RelativeAltitudeM = Annotated[
    float, Field(ge=-1000, le=20_000, allow_inf_nan=False, description="altitude above home in metres")
]
AbsoluteAltitudeM = Annotated[
    float, Field(ge=-1000, le=20_000, allow_inf_nan=False, description="altitude above mean sea level in metres")
]
YawDeg = Annotated[float, Field(ge=-360, le=360, allow_inf_nan=False, description="heading, clockwise from north")]
Seconds = Annotated[float, Field(ge=0, le=86_400, allow_inf_nan=False)]
SpeedMS = Annotated[float, Field(ge=0.1, le=150, allow_inf_nan=False, description="metres per second")]
"""No vehicle flies more slowly. A speed is divided by, and sent as float32, in which 1e-50 is 0."""
SMALLEST_RADIUS_M: Final = 0.01
RadiusM = Annotated[float, Field(ge=SMALLEST_RADIUS_M, le=10_000, allow_inf_nan=False)]
SignedRadiusM = Annotated[
    float,
    Field(ge=-10_000, le=10_000, allow_inf_nan=False, description="positive clockwise, negative counterclockwise"),
]
FROM_JSON: Final = Strict(False)
"""For types without a JSON form of their own: an array becomes a tuple, a string a member of an enumeration."""


def _whole(value: object) -> object:
    return int(value) if isinstance(value, float) and value.is_integer() else value


WHOLE: Final = BeforeValidator(_whole)
"""For integers: JSON does not tell 1.0 from 1, and some writers write all numbers so."""


def _not_null(value: object) -> object:
    if value is None:
        raise PydanticCustomError("null_refused", "null is ambiguous here: state the value, or omit the field")
    return value


NULL_REFUSED: Final = BeforeValidator(_not_null)
"""For fields where taking null for the default would remove a safeguard."""


ItemId = Annotated[
    str,
    Field(max_length=64, pattern=r"^([A-Za-z0-9][A-Za-z0-9_.-]*)?$", description="stable name; generated if omitted"),
]


class PlanModel(BaseModel):
    """Strict and frozen, without unknown fields. `null` means "not set", except for fields with NULL_REFUSED."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _null_is_not_given(cls, value: object) -> object:
        if not isinstance(value, dict) or None not in value.values():
            return value
        defaults = {
            name
            for name, field in cls.model_fields.items()
            if not field.is_required() and NULL_REFUSED not in field.metadata
        }
        return {name: part for name, part in value.items() if part is not None or name not in defaults}


class Altitude(PlanModel):
    """Requires exactly one of the two altitudes."""

    relative_altitude_m: RelativeAltitudeM | None = None
    absolute_altitude_m: AbsoluteAltitudeM | None = None

    @model_validator(mode="after")
    def _exactly_one_altitude(self) -> Self:
        if (self.relative_altitude_m is None) == (self.absolute_altitude_m is None):
            raise PydanticCustomError(
                "altitude_exactly_one", "specify exactly one of relative_altitude_m and absolute_altitude_m"
            )
        return self


def relative_altitude_m(altitude: Altitude, home: GlobalPosition) -> float:
    """Return the altitude above home in metres."""
    if altitude.relative_altitude_m is not None:
        return altitude.relative_altitude_m
    return (altitude.absolute_altitude_m or 0.0) - home.altitude_m


class Position(Altitude):
    """A position in the air or on the ground."""

    latitude_deg: LatitudeDeg
    longitude_deg: LongitudeDeg


class Point(PlanModel):
    """A horizontal position."""

    latitude_deg: LatitudeDeg
    longitude_deg: LongitudeDeg
