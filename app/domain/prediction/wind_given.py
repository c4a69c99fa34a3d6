"""The wind as people and programs give it: where it comes from, or where the air goes."""

from __future__ import annotations

import math
from typing import Annotated, Final, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.prediction.wind import Wind

STRONGEST_M_S: Final = 75.0
_Component = Annotated[float, Field(ge=-STRONGEST_M_S, le=STRONGEST_M_S)]


class WindGiven(BaseModel):
    """A steady wind: `from_deg` (clockwise from north, where it comes from) and `speed_m_s`, as in weather reports,
    or `north_m_s` and `east_m_s`, where the air goes.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    from_deg: Annotated[float, Field(ge=0, le=360)] | None = None
    speed_m_s: Annotated[float, Field(ge=0, le=STRONGEST_M_S)] | None = None
    north_m_s: _Component | None = None
    east_m_s: _Component | None = None

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> Self:
        polar, parts = (self.from_deg, self.speed_m_s), (self.north_m_s, self.east_m_s)
        whole = [pair for pair in (polar, parts) if None not in pair]
        if len(whole) != 1 or any(pair not in whole and pair != (None, None) for pair in (polar, parts)):
            raise PydanticCustomError("wind", "give from_deg and speed_m_s, or north_m_s and east_m_s")
        return self

    def wind(self) -> Wind:
        """Where the air goes."""
        if self.from_deg is None or self.speed_m_s is None:
            return Wind(self.north_m_s or 0.0, self.east_m_s or 0.0)
        towards = math.radians(self.from_deg + 180.0)
        return Wind(round(self.speed_m_s * math.cos(towards), 6), round(self.speed_m_s * math.sin(towards), 6))
