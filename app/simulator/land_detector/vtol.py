"""VTOLs: as multicopters; in fixed-wing flight they land by disarming alone."""

from __future__ import annotations

from app.simulator.land_detector.multicopter import MulticopterLandDetector
from app.simulator.land_detector.sample import LandSample


class VtolLandDetector(MulticopterLandDetector):
    """Hovering and in transition the multicopter's rules hold. Landed follows from maybe landed there, so here too."""

    def _is_freefall(self, sample: LandSample) -> bool:
        return not sample.fixed_wing and super()._is_freefall(sample)

    def _is_maybe_landed(self, sample: LandSample) -> bool:
        return not sample.armed if sample.fixed_wing else super()._is_maybe_landed(sample)
