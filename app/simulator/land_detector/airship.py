"""Airships: nothing but disarming tells that they have landed."""

from __future__ import annotations

from app.simulator.land_detector.base import LandDetector
from app.simulator.land_detector.sample import LandSample


class AirshipLandDetector(LandDetector):
    """No contact, no free fall: it floats."""

    def _set_times(self, factor: int) -> None:
        self._landed.rise_s = self._landed.fall_s = 0.0

    def _is_landed(self, sample: LandSample) -> bool:
        return not sample.armed
