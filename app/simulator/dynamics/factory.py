"""The dynamics of each vehicle type."""

from __future__ import annotations

from app.simulator.airframe import Airframe
from app.simulator.dynamics.model import Dynamics
from app.simulator.dynamics.multicopter import Multicopter
from app.simulator.params import Params
from app.simulator.state import Status


def dynamics_for(airframe: Airframe, params: Params, status: Status) -> Dynamics:
    """A fresh model."""
    return Multicopter(params)
