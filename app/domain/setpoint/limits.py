"""What may be configured of the limits of offboard control."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class OffboardLimits(BaseModel):
    """null: no such limit. Altitudes are above home; a rover has none. A fence is the one on board of the vehicle."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    max_speed_m_s: _Positive | None = 10.0
    max_climb_m_s: _Positive | None = 3.0
    max_descend_m_s: _Positive | None = 2.0
    max_tilt_deg: Annotated[float, Field(gt=0, lt=90)] | None = 35.0
    max_distance_m: _Positive | None = 1000.0
    min_altitude_m: float | None = 2.0
    max_altitude_m: float | None = 120.0
    beyond: Literal["clamp", "refuse"] = "clamp"
