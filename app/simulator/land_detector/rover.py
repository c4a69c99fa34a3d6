"""Rovers: always in contact; landed when disarmed, in land mode, or back home in a return."""

from __future__ import annotations

from app.simulator.land_detector.base import LandDetector
from app.simulator.land_detector.sample import LandSample
from app.simulator.wire import Mode

LEAVES_S = 0.5
"""Armed it is "in the air" after this time [25_land_detector_rover]."""


class RoverLandDetector(LandDetector):
    """So a rover never lands in a mission, and a LAND item there never completes."""

    def _set_times(self, factor: int) -> None:
        self._landed.fall_s = LEAVES_S

    def _is_ground_contact(self, sample: LandSample) -> bool:
        return True

    def _is_landed(self, sample: LandSample) -> bool:
        if sample.mode is Mode.LAND:
            return True
        back_home = sample.mode is Mode.RTL and sample.home_distance_m < float(self._params["NAV_ACC_RAD"])
        return back_home or not sample.armed
