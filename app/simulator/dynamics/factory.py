"""The dynamics of each vehicle type."""

from __future__ import annotations

from app.simulator.airframe import Airframe
from app.simulator.dynamics.airship import Airship
from app.simulator.dynamics.fixed_wing import FixedWing
from app.simulator.dynamics.model import Dynamics
from app.simulator.dynamics.multicopter import Multicopter
from app.simulator.dynamics.rover import Rover
from app.simulator.dynamics.vtol import Vtol
from app.simulator.geo import LocalFrame
from app.simulator.params import Params
from app.simulator.state import Status


def dynamics_for(airframe: Airframe, params: Params, status: Status, frame: LocalFrame) -> Dynamics:
    """A fresh model. `frame`: where on earth it is."""
    if airframe.is_vtol:
        return Vtol(params, status, airframe.hover_throttle)
    if airframe.is_fixed_wing:
        return FixedWing(params)
    if airframe.is_rover:
        return Rover(params, frame)
    return Airship(params) if airframe.is_airship else Multicopter(params, status, airframe.hover_throttle)
