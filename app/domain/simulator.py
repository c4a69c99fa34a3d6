"""The port to the simulated vehicles: what they truly do, their faults and their speed. vehicles/ implements it."""

from __future__ import annotations

from typing import Any, Final, Protocol

from pydantic import BaseModel, ConfigDict, Field

MAX_SPEED: Final = 50.0
"""Vehicle time over wall time, as fast as the simulator goes."""


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


class SpeedOrder(BaseModel):
    """How fast the simulated vehicles' time is to run: vehicle time over wall time."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    speed: float = Field(ge=1.0, le=MAX_SPEED, allow_inf_nan=False)


class SimulatorSpeed(BaseModel):
    """Vehicle time over wall time: `wanted`, and `achieved` lately (null in the first second after a change).

    `behind`: this machine cannot keep what is wanted. The vehicles fly the same, only slower.
    """

    model_config = ConfigDict(frozen=True)

    wanted: float
    achieved: float | None
    behind: bool


class SimulatorState(BaseModel):
    """All simulated vehicles as they are now, and how fast their time runs."""

    model_config = ConfigDict(frozen=True)

    speed: SimulatorSpeed
    vehicles: tuple[SimulatedVehicle, ...]


class SimulatorControl(Protocol):
    """The control of one simulator process.

    Every method may raise SimulatorRefusedError with the simulator's reason, or SimulatorSilentError.
    """

    async def state(self) -> SimulatorState:
        """What there is now."""

    async def set_fault(self, fault: str, value: object, *, system_id: int | None) -> None:
        """Set a fault of one vehicle, or of all. After SimulatorSilentError it may be set or not."""

    async def set_speed(self, speed: float) -> SimulatorSpeed:
        """Change the speed of all, in flight too. After SimulatorSilentError it may be changed or not."""
