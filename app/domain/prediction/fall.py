"""How a parcel falls: with the speed that it leaves with, with the drag of its box, and with the wind."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.domain.prediction.motion import Point
from app.domain.prediction.wind import CALM, Wind

GRAVITY_M_S2 = 9.80665
TERMINAL_M_S = 20.0
"""At which drag bears the weight: assumed, of a box of a kilogram with 0.04 m2 and a drag coefficient of 1."""
_STEPS = 200
_SHORTEST_STEP_S, _LONGEST_STEP_S = 0.005, 0.1
"""A longer one is not stable at the speeds that a plan can ask for."""
State = tuple[float, float, float]
"""East, north, down."""


@dataclass(frozen=True, slots=True)
class Fall:
    """How long it takes, and how far east and north of the release the parcel comes down."""

    duration_s: float
    moved: Point

    @property
    def throw_m(self) -> float:
        """Over ground, from the release to where it comes down."""
        return math.hypot(*self.moved)


def fall(height_m: float, velocity_m_s: Point, wind: Wind = CALM, terminal_m_s: float = TERMINAL_M_S) -> Fall:
    """From `height_m` to the height of home; quadratic drag against air that moves with the wind at all heights."""
    if height_m <= 0.0:
        return Fall(0.0, (0.0, 0.0))
    air: State = (wind.east_m_s, wind.north_m_s, 0.0)
    about_s = height_m / terminal_m_s + math.sqrt(2.0 * height_m / GRAVITY_M_S2)
    step_s = min(max(_SHORTEST_STEP_S, about_s / _STEPS), _LONGEST_STEP_S)
    place: State = (0.0, 0.0, 0.0)
    velocity: State = (*velocity_m_s, 0.0)
    seconds = 0.0
    while True:
        middle = _after(velocity, _pull(velocity, air, terminal_m_s), step_s / 2.0)
        following = _after(place, middle, step_s)
        if following[2] >= height_m:
            share = (height_m - place[2]) / (following[2] - place[2])
            end = _after(place, middle, share * step_s)
            return Fall(seconds + share * step_s, end[:2])
        velocity = _after(velocity, _pull(middle, air, terminal_m_s), step_s)
        place, seconds = following, seconds + step_s


def _after(start: State, rate: State, seconds: float) -> State:
    return (start[0] + rate[0] * seconds, start[1] + rate[1] * seconds, start[2] + rate[2] * seconds)


def _pull(velocity: State, air: State, terminal_m_s: float) -> State:
    """Gravity, and drag that grows with the square of the speed through the air."""
    through = (velocity[0] - air[0], velocity[1] - air[1], velocity[2] - air[2])
    drag = GRAVITY_M_S2 * math.sqrt(sum(part * part for part in through)) / terminal_m_s**2
    return (-drag * through[0], -drag * through[1], GRAVITY_M_S2 - drag * through[2])
