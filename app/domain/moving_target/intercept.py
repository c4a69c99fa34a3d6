"""When something that flies straight at one speed meets something that moves on at a constant velocity."""

from __future__ import annotations

import math


def intercept_s(north_m: float, east_m: float, north_m_s: float, east_m_s: float, speed_m_s: float) -> float | None:
    """Seconds until the first meeting; None if there is none.

    The target is at (`north_m`, `east_m`) from the vehicle. |p + v t| = s t is a quadratic in t; its roots are taken by
    the form that loses no digits (q = -(b + sign(b) sqrt(d)) / 2).
    """
    c = north_m**2 + east_m**2
    if c == 0.0:
        return 0.0
    a = north_m_s**2 + east_m_s**2 - speed_m_s**2
    b = 2.0 * (north_m * north_m_s + east_m * east_m_s)
    discriminant = b**2 - 4.0 * a * c
    if discriminant < 0.0:
        return None
    q = -(b + math.copysign(math.sqrt(discriminant), b)) / 2.0
    roots = [q / a if a != 0.0 else math.inf, c / q if q != 0.0 else math.inf]
    return min((root for root in roots if 0.0 < root < math.inf), default=None)
