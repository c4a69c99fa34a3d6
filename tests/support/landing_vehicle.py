"""A land detector alone, fed with readings by hand; and the landings that were recorded from PX4."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any

from app.simulator.airframe import AIRFRAMES
from app.simulator.clock import VehicleClock
from app.simulator.faults import VehicleFaults
from app.simulator.land_detector.detectors import land_detector_for
from app.simulator.land_detector.sensing import LandSample, TakeoffState
from app.simulator.params import Params, Value
from app.simulator.state import LandDetected, VehicleState
from app.simulator.wire import Mode
from tests.support.paths import DATA

RECORDED = DATA / "land_detector"

STANDING = LandSample(
    armed=True,
    mode=Mode.MISSION,
    fixed_wing=False,
    v_xy_m_s=0.0,
    v_xy_valid=True,
    v_z_m_s=0.0,
    climb_command_m_s=-0.3,
    throttle=0.0,
    hover_throttle=0.5,
    airspeed_m_s=0.0,
    specific_force_m_s2=9.81,
    acceleration_xy_m_s2=0.0,
    rate_xy_rad_s=0.0,
    rate_rad_s=0.0,
    dist_bottom_m=0.0,
    has_range_sensor=True,
    takeoff_state=TakeoffState.GROUND,
)
"""Landed in every respect, told to go down."""
FLYING = replace(
    STANDING,
    v_xy_m_s=12.0,
    v_z_m_s=2.0,
    climb_command_m_s=2.0,
    throttle=0.6,
    airspeed_m_s=12.0,
    dist_bottom_m=30.0,
    takeoff_state=TakeoffState.FLIGHT,
)
"""Landed in no respect."""


class LandDetectorHarness:
    """Readings in, states out."""

    def __init__(self, airframe: str, **params: Value) -> None:
        self.clock = VehicleClock()
        self.params = Params(params)
        self._state = VehicleState()
        self._detector = land_detector_for(AIRFRAMES[airframe], self._state, self.params, self.clock, VehicleFaults())
        self._detector.boot()

    def reboot(self) -> None:
        """The autopilot's clock and its detector begin anew."""
        self.clock.restart()
        self._detector.boot()

    @property
    def land(self) -> LandDetected:
        return self._state.status.land

    def feed(self, sample: LandSample, seconds: float) -> LandDetected:
        """The same readings for some time; what was published last."""
        for _ in range(round(seconds / VehicleClock.STEP_S)):
            self.clock.advance()
            self._detector.take(sample)
        return self.land

    def seconds_until(self, state: str, wanted: bool, sample: LandSample, limit_s: float = 20.0) -> float:
        """How long these readings need to make a state so. Fails after `limit_s`."""
        start_s = self.clock.now_s
        while getattr(self.land, state) is not wanted:
            assert self.clock.now_s - start_s < limit_s, f"{state} did not become {wanted}"
            self.feed(sample, VehicleClock.STEP_S)
        return self.clock.now_s - start_s

    def never(self, state: str, sample: LandSample, seconds: float = 10.0) -> bool:
        """Whether these readings leave a state False all the time."""
        return not any(getattr(self.feed(sample, VehicleClock.STEP_S), state) for _ in range(round(seconds * 50)))

    def flown(self) -> LandDetectorHarness:
        """After a second in the air."""
        self.feed(FLYING, 1.0)
        assert not self.land.landed
        return self


@dataclass(frozen=True)
class Recording:
    """One extract of the recordings; times are the vehicle's, in seconds."""

    moments: list[tuple[float, str]]
    extended_sys_state: list[tuple[float, int, int]]
    """Changes: time, vtol_state, landed_state."""
    motion: list[tuple[float, float, float, float]]
    """Near the landings: time, height, climb rate, ground speed."""

    def between(self, first: str, then: str, number: int = 0) -> float:
        """From the n-th moment of one name to the next one of the other."""
        start_s = [time_s for time_s, name in self.moments if name == first][number]
        return next(time_s for time_s, name in self.moments if name == then and time_s >= start_s) - start_s

    def touch_down_to_landed(self, number: int = 0) -> float:
        """From the last reading that still sinks to the detection."""
        landed_s = [time_s for time_s, name in self.moments if name == "landing detected"][number]
        return landed_s - max(time_s for time_s, _, climb, _ in self.motion if climb < -0.2 and time_s < landed_s)

    @property
    def landed_states(self) -> list[int]:
        """Without repetitions."""
        states = [state for _, _, state in self.extended_sys_state]
        return [state for index, state in enumerate(states) if index == 0 or states[index - 1] != state]


def recording(kind: str) -> Recording:
    data: dict[str, Any] = json.loads((RECORDED / f"{kind}.json").read_text(encoding="utf-8"))
    return Recording(
        [(time_s, name) for time_s, name in data["moments"]],
        [(time_s, vtol, landed) for time_s, vtol, landed in data["extended_sys_state"]],
        [(time_s, up, climb, speed) for time_s, up, climb, speed in data["motion"]],
    )
