"""Declarations of an operator about a vehicle that no message reports: its payload and its power consumption."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Final, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

DEFAULT_RESERVE_PERCENT: Final = 20.0
_Power = Annotated[float, Field(gt=0, le=1e6)]


class Phase(StrEnum):
    """What the vehicle does while it consumes power. Standing and descending count as hovering."""

    HOVER = "hover"
    CRUISE = "cruise"
    CLIMB = "climb"


class Performance(BaseModel):
    """Of one vehicle as it flies deliveries, loaded. null: not declared.

    Either watts with the battery's usable capacity, or one rate in per cent a minute for all of the flight. A
    `hover_w` or `climb_w` that is not given is the highest rate that is. `reserve_percent` is what must be left.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    payload_max_kg: Annotated[float, Field(ge=0, le=10_000)] | None = None
    battery_capacity_wh: Annotated[float, Field(gt=0, le=1e7)] | None = None
    cruise_w: _Power | None = None
    hover_w: _Power | None = None
    climb_w: _Power | None = None
    battery_percent_per_min: Annotated[float, Field(gt=0, le=6000)] | None = None
    reserve_percent: Annotated[float, Field(ge=0, lt=100)] = DEFAULT_RESERVE_PERCENT

    @model_validator(mode="after")
    def _one_kind_of_rate(self) -> Self:
        watts = [rate for rate in (self.cruise_w, self.hover_w, self.climb_w) if rate is not None]
        if self.battery_percent_per_min is not None and watts:
            raise PydanticCustomError("rates", "give watts or battery_percent_per_min, not both")
        if watts and (self.cruise_w is None or self.battery_capacity_wh is None):
            raise PydanticCustomError("rates", "watts need cruise_w and battery_capacity_wh")
        return self

    @property
    def has_energy_rates(self) -> bool:
        """Whether the battery use can be computed."""
        return self.cruise_w is not None or self.battery_percent_per_min is not None

    def percent_per_s(self, phase: Phase) -> float:
        """Of the full battery; 0 if nothing is declared."""
        if self.battery_percent_per_min is not None:
            return self.battery_percent_per_min / 60.0
        if self.cruise_w is None or self.battery_capacity_wh is None:
            return 0.0
        given = {Phase.CRUISE: self.cruise_w, Phase.HOVER: self.hover_w, Phase.CLIMB: self.climb_w}
        watts = given[phase] or max(rate for rate in given.values() if rate is not None)
        return 100.0 * watts / 3600.0 / self.battery_capacity_wh

    def wh(self, percent: float) -> float | None:
        """The energy of such a share of the battery; None without its capacity."""
        return None if self.battery_capacity_wh is None else self.battery_capacity_wh * percent / 100.0
