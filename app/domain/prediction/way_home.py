"""What a return from a drop takes from the battery: if the drop fails, or the link is lost there."""

from __future__ import annotations

from dataclasses import replace

from app.domain.carried import Carried
from app.domain.items import ReturnToLaunch
from app.domain.plan.drops import DropUse
from app.domain.prediction.durations import Ahead, effort
from app.domain.prediction.effort import Flight
from app.domain.prediction.energy import used_percent
from app.domain.prediction.motion import Motion
from app.domain.speeds import cruise_speed_m_s

_RETURN = ReturnToLaunch(type="return_to_launch")


def way_home_percent(flight: Flight, there: Motion, drop: DropUse, ahead: Ahead) -> float | None:
    """Of a full battery, by the vehicle's own RTL settings and cruise speed; None if no rate is declared."""
    if flight.facts.performance is None:
        return None
    after = Carried.WHEELS if drop.carried is Carried.WHEELS else Carried.GROUND
    step = replace(drop.step, item=_RETURN, before=drop.carried, after=after)
    flies = Carried.ROTARY_WING if drop.carried is Carried.GROUND else drop.carried
    speed_m_s = cruise_speed_m_s(flight.facts, flies)
    took = effort(flight, there, step, speed_m_s, None, ahead)
    return used_percent(flight.facts, there, step, took, speed_m_s)
