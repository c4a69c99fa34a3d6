"""The port to the simulated vehicles: their true state, their faults, their speed. vehicles/ implements it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Final, Literal, Protocol, get_args

from pydantic import ConfigDict, Field, RootModel

from app.domain.autopilot import behaviour_of
from app.domain.model import Frozen, StrictForm
from app.domain.vehicle.state import VehicleType

# What can be made wrong with a simulated vehicle: each fault with the type and range of its value.
#
# The simulator has the same table (docs/reference/simulator.md) and imports nothing of ours; a test compares the two.


ModeName = Literal[
    "MANUAL",
    "ALTCTL",
    "POSCTL",
    "ORBIT",
    "ACRO",
    "OFFBOARD",
    "STABILIZED",
    "TERMINATION",
    "TAKEOFF",
    "LOITER",
    "MISSION",
    "RTL",
    "LAND",
]
"""PX4's modes as the simulator names them (custom_mode of HEARTBEAT)."""

AirSpeed = Annotated[float, Field(ge=-30.0, le=30.0, allow_inf_nan=False)]


class _Fault(StrictForm):
    """`vehicle` is the id that Waydrop gave it, null for all; it must be said. Unknown fields are errors."""

    vehicle: Annotated[str, Field(min_length=1, max_length=100)] | None


class ShareFault(_Fault):
    """Happens to a share of the datagrams."""

    fault: Literal["loss", "duplicate", "reorder"]
    value: float = Field(ge=0.0, le=1.0, allow_inf_nan=False, description="share of all datagrams, 0 to 1")


class DelayFault(_Fault):
    """Makes datagrams late."""

    fault: Literal["delay_s", "jitter_s"]
    value: float = Field(ge=0.0, le=60.0, allow_inf_nan=False, description="seconds")


class SwitchFault(_Fault):
    """Is there or not."""

    fault: Literal[
        "link_cut", "stuck_gripper", "no_gripper", "stuck_winch", "gps_loss", "range_loss", "duplicate_sysid"
    ]
    value: bool = Field(description="true sets it, false clears it")


class RebootFault(_Fault):
    """Restarts the autopilot once."""

    fault: Literal["reboot"]
    value: Literal[True] = Field(description="true: now")


class RefuseUploadFault(_Fault):
    """Refuses missions."""

    fault: Literal["refuse_upload"]
    value: int = Field(ge=0, le=15, description="MAV_MISSION_RESULT of the refusal; 0 refuses no more")


class LostAckFault(_Fault):
    """Keeps acks back."""

    fault: Literal["lost_ack"]
    value: int = Field(ge=0, le=1000, description="so many acks")


class SlowGripperFault(_Fault):
    """Slows the gripper."""

    fault: Literal["slow_gripper"]
    value: float = Field(
        ge=0.0, le=600.0, allow_inf_nan=False, description="seconds longer", json_schema_extra={"unit": "s"}
    )


class BatteryFault(_Fault):
    """Drains the battery at once."""

    fault: Literal["battery_percent"]
    value: float = Field(ge=0.0, le=100.0, allow_inf_nan=False, description="percent that remain")


class WindFault(_Fault):
    """Moves the air."""

    fault: Literal["wind"]
    value: tuple[Annotated[AirSpeed, Field(title="north")], Annotated[AirSpeed, Field(title="east")]] = Field(
        description="[north, east] in m/s: where the air moves to", json_schema_extra={"unit": "m/s"}
    )


class ModeFault(_Fault):
    """A pilot at the sticks."""

    fault: Literal["mode"]
    value: ModeName = Field(description="PX4's mode")


class SecondGroundFault(_Fault):
    """Another ground station."""

    fault: Literal["second_gcs"]
    value: Literal["upload", "clear", "open_transfer"] = Field(
        description="replaces the mission, empties it, or begins an upload and falls silent"
    )


Fault = (
    ShareFault
    | DelayFault
    | SwitchFault
    | RebootFault
    | RefuseUploadFault
    | LostAckFault
    | SlowGripperFault
    | BatteryFault
    | WindFault
    | ModeFault
    | SecondGroundFault
)


class FaultRequest(RootModel[Annotated[Fault, Field(discriminator="fault")]]):
    """One fault for one simulated vehicle, or for all of them."""

    model_config = ConfigDict(frozen=True)


class FaultKind(Frozen):
    """A fault that the simulator knows. `value_schema` is the JSON Schema of its value."""

    fault: str
    effect: str
    value_schema: dict[str, Any]


_LINK_LOSS: Final = behaviour_of(VehicleType.MULTICOPTER, None).link_loss.setting.name
_EFFECTS: Final[dict[str, str]] = {
    "loss": "datagrams are lost, both ways",
    "duplicate": "datagrams come twice",
    "reorder": "datagrams are overtaken by the next ones",
    "delay_s": "datagrams come late",
    "jitter_s": "datagrams come up to this much later, each by itself",
    "link_cut": f"nothing passes; the vehicle's own link-loss failsafe acts as {_LINK_LOSS} says",
    "stuck_gripper": "the gripper acknowledges and does not move: nothing on the link shows it",
    "no_gripper": "the gripper is not there any more: each command to it is answered FAILED",
    "stuck_winch": "the winch does not pay out",
    "gps_loss": "no position",
    "range_loss": "the range sensor sees nothing: a hovering vehicle's landing takes three times longer to detect",
    "duplicate_sysid": "a second vehicle with the same system id appears",
    "reboot": "the autopilot restarts; missions and parameters are kept, the item index is 0 again",
    "refuse_upload": "the next uploads are refused",
    "lost_ack": "acks of commands and missions are not sent",
    "slow_gripper": "longer from IN_PROGRESS to ACCEPTED",
    "battery_percent": "the battery is at this charge, then draining goes on",
    "wind": "constant wind",
    "mode": "a pilot at the sticks changes the mode",
    "second_gcs": "another ground station changes the mission",
}


def _kinds() -> Iterator[FaultKind]:
    for model in get_args(Fault):
        schema = model.model_json_schema()["properties"]["value"]
        value_schema = {key: part for key, part in schema.items() if key != "title"}
        for name in get_args(model.model_fields["fault"].annotation):
            yield FaultKind(fault=name, effect=_EFFECTS[name], value_schema=value_schema)


FAULT_KINDS: Final[tuple[FaultKind, ...]] = tuple(_kinds())
"""All faults there are."""


MAX_SPEED: Final = 50.0
"""Vehicle time over wall time; unlimited if the simulator can keep up."""


class SimulatedVehicle(Frozen):
    """The truth about one simulated vehicle, whatever its link reports.

    `height_m` is above its starting point, `time_s` its clock since boot. `faults` are the active faults by name,
    without one-time faults (a reboot, a mode change).
    """

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
    faults: dict[str, Any] = Field(default={})


class SpeedRequest(StrictForm):
    """How fast the simulated vehicles' time is to run: vehicle time over wall time."""

    speed: float = Field(ge=1.0, le=MAX_SPEED, allow_inf_nan=False)


class SimulatorSpeed(Frozen):
    """Vehicle time over wall time: `wanted`, and `achieved` lately (null in the first second after a change).

    `behind`: this machine is too slow for the wanted speed. The vehicles fly the same, only slower.
    """

    wanted: float
    achieved: float | None
    behind: bool


class SimulatorState(Frozen):
    """All simulated vehicles as they are now, and how fast their time runs."""

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
