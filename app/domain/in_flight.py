"""A vehicle in flight: where a mission begins that is uploaded to it there."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class InFlight(BaseModel):
    """Place and motion at one moment; the altitude is above home.

    `wing_borne`: a VTOL that flies on its wing (EXTENDED_SYS_STATE.vtol_state). `asked_speed_m_s` is the speed that the
    plan asked for last: a new mission has to ask for it again. None: its own cruise speed.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    latitude_deg: float
    longitude_deg: float
    relative_altitude_m: float
    ground_speed_m_s: float = 0.0
    course_deg: float | None = None
    wing_borne: bool = False
    asked_speed_m_s: float | None = None
