"""What the air does to a hovering VTOL: flat plates at any angle of attack (PX4's SIH standard VTOL, aero.hpp)."""

from __future__ import annotations

import math
from dataclasses import dataclass

AIR_KG_M3 = 1.17
"""At 490 m above the sea."""
MASS_KG = 0.2
DRAG_PER_S = 1.0  # SIH_KDV over the mass
STALL_RAD = math.radians(20.0)
BLEND_RAD = math.radians(10.0)
PLATE_DRAG = 0.04
NORMAL_DRAG = 1.98
FINS_M2 = 0.2 * 0.8 + 0.25 * 0.18
"""Fuselage and fin: upright plates, which only have their drag along the flow."""
PUSHER_M = 8 * 0.0254
PUSHER_REV_S = 9000 / 60.0


@dataclass(frozen=True, slots=True)
class AirForce:
    """Accelerations along the body's axes in m/s2, and what the lift motors lose of their thrust to its moment."""

    backward_m_s2: float
    downward_m_s2: float
    nose_up_nm: float


@dataclass(frozen=True, slots=True)
class _Plate:
    span_m: float
    chord_m: float
    zero_lift_rad: float
    arm_m: float
    """Behind the centre of mass."""

    def force(self, attack_rad: float, speed_m_s: float) -> tuple[float, float, float]:
        """Forward and upward in newton, nose up in newton metres."""
        angle = attack_rad - self.zero_lift_rad
        lift, drag, moment = self._coefficients(angle)
        newton = 0.5 * AIR_KG_M3 * speed_m_s**2 * self.span_m * self.chord_m
        forward = newton * (lift * math.sin(angle) - drag * math.cos(angle))
        upward = newton * (lift * math.cos(angle) + drag * math.sin(angle))
        return forward, upward, newton * self.chord_m * moment - self.arm_m * upward

    def _coefficients(self, angle: float) -> tuple[float, float, float]:
        """Of lift, drag and moment: attached flow up to the stall, a plate across the flow beyond."""
        ratio = self.span_m / self.chord_m
        slope = 2.0 * math.pi / (1.0 + 2.0 * (ratio + 4.0) / (ratio * (ratio + 2.0)))
        sin, cos = math.sin(angle), math.cos(angle)
        edge = 1.0 / (0.56 + 0.44 * abs(sin)) - 0.41 * (1.0 - math.exp(-17.0 / ratio))
        normal, along = NORMAL_DRAG * sin * edge, 0.5 * PLATE_DRAG * cos
        stalled = normal * cos - along * sin, normal * sin + along * cos
        moment = -normal * (0.25 - 7.0 / 40.0 * (1.0 - 2.0 / math.pi * abs(angle)))
        lift = slope * sin * cos * cos + math.pi * abs(sin) * sin * cos
        drag = PLATE_DRAG + abs(stalled[0] * math.tan(angle)) if abs(cos) > 0.1 else stalled[1]
        limit = STALL_RAD - math.copysign(1.0, angle) * self.zero_lift_rad
        attached = 0.5 * (1.0 - math.tanh(4.0 * (abs(angle) - limit) / BLEND_RAD))
        return (
            attached * lift + (1.0 - attached) * stalled[0],
            attached * drag + (1.0 - attached) * stalled[1],
            -attached * 0.17 * math.pi * abs(sin) * sin + (1.0 - attached) * moment,
        )


_PLATES = (_Plate(0.86, 0.21, math.radians(-4.0), 0.0), _Plate(0.3, 0.1, 0.0, 0.4))


def air_force(forward_m_s: float, down_m_s: float) -> AirForce:
    """Of the air that a body with these speeds along its own axes meets."""
    speed = math.hypot(forward_m_s, down_m_s)
    if speed < 0.1:
        return AirForce(DRAG_PER_S * forward_m_s, -DRAG_PER_S * down_m_s, 0.0)
    attack = math.atan2(down_m_s, forward_m_s)
    ahead, up, nose_up = (sum(parts) for parts in zip(*(p.force(attack, speed) for p in _PLATES), strict=True))
    ahead -= 0.5 * AIR_KG_M3 * forward_m_s * abs(forward_m_s) * FINS_M2 * PLATE_DRAG
    return AirForce(
        DRAG_PER_S * forward_m_s - ahead / MASS_KG, -DRAG_PER_S * down_m_s - up / MASS_KG, max(0.0, nose_up)
    )


def push_m_s2(throttle: float, airspeed_m_s: float) -> float:
    """Acceleration by the pusher propeller (SIH_F_CT0 to SIH_F_CT2)."""
    turns_per_s = PUSHER_REV_S * math.sqrt(max(0.0, min(1.0, throttle)))
    if turns_per_s < 1.0:
        return 0.0
    advance = airspeed_m_s / turns_per_s / PUSHER_M
    coefficient = max(0.0, 0.131 + 0.004 * advance - 0.146 * advance**2)
    return coefficient * AIR_KG_M3 * turns_per_s**2 * PUSHER_M**4 / MASS_KG
