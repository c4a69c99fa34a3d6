"""Whether the vehicle is wholly still."""

from __future__ import annotations

import math

from app.simulator.land_detector.sample import LandSample

GYRO_MAX_RAD_S = math.radians(3.0)
ROLLING_M_S = 0.1
STILL_S = 1.0


class AtRest:
    """True a second after the last movement. Modelled: turning motors and rolling wheels shake the frame."""

    def __init__(self, now_s: float) -> None:
        self._moved_at_s = now_s

    def update(self, sample: LandSample, now_s: float) -> bool:
        """One cycle; whether the vehicle is at rest (the base adds that it has to be landed)."""
        shakes = sample.throttle > 0.0 or sample.v_xy_m_s > ROLLING_M_S
        if shakes or sample.rate_rad_s > GYRO_MAX_RAD_S:
            self._moved_at_s = now_s
        return now_s - self._moved_at_s > STILL_S
