"""The port to the simulated vehicles: what they truly do, and their faults. vehicles/ implements it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from pydantic import BaseModel, ConfigDict


class SimulatedVehicle(BaseModel):
    """The truth about one simulated vehicle, whatever its link tells.

    `height_m` is above the place it started from, `time_s` its own clock since boot. `faults` holds those that last
    (not what happened once: a reboot, a mode) and are set now, by name.
    """

    model_config = ConfigDict(frozen=True)

    system_id: int
    type: str
    latitude_deg: float
    longitude_deg: float
    height_m: float
    ground_speed_m_s: float
    armed: bool
    mode: str
    landed_state: str
    mission_seq: int
    gripper_open: bool
    time_s: float
    faults: dict[str, Any] = {}


class SimulatorControl(Protocol):
    """The control of one simulator process.

    Every method may raise SimulatorRefusedError with the simulator's reason, or SimulatorSilentError.
    """

    async def vehicles(self) -> Sequence[SimulatedVehicle]:
        """All simulated vehicles as they are now."""

    async def set_fault(self, fault: str, value: object, *, system_id: int | None) -> None:
        """Set a fault of one vehicle, or of all. After SimulatorSilentError it may be set or not."""
