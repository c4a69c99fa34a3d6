"""The land detector of each vehicle type."""

from __future__ import annotations

from app.simulator.airframe import Airframe
from app.simulator.clock import VehicleClock
from app.simulator.faults import VehicleFaults
from app.simulator.land_detector.airship import AirshipLandDetector
from app.simulator.land_detector.base import LandDetector
from app.simulator.land_detector.fixed_wing import FixedWingLandDetector
from app.simulator.land_detector.multicopter import MulticopterLandDetector
from app.simulator.land_detector.rover import RoverLandDetector
from app.simulator.land_detector.sensing import Sensing
from app.simulator.land_detector.vtol import VtolLandDetector
from app.simulator.params import Params
from app.simulator.state import VehicleState

DETECTORS: dict[str, type[LandDetector]] = {
    "plane": FixedWingLandDetector,
    "vtol": VtolLandDetector,
    "rover": RoverLandDetector,
    "airship": AirshipLandDetector,
}


def land_detector_for(
    airframe: Airframe, state: VehicleState, params: Params, clock: VehicleClock, faults: VehicleFaults
) -> LandDetector:
    """A fresh detector; what is none of the others is a multicopter."""
    detector = DETECTORS.get(airframe.name, MulticopterLandDetector)
    return detector(state.status, params, clock, Sensing(state, airframe, params, faults))
