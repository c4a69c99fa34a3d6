"""The face of a payload component towards the port it hangs on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message
from app.simulator.geo import LocalFrame
from app.simulator.radio import Radio
from app.simulator.state import VehicleState
from app.simulator.wire import Result

Params4 = tuple[float, float, float, float]
Answer = Callable[[Result], None]
"""Called with every result for the one who asked: IN_PROGRESS first, then the final one."""


@dataclass(frozen=True, slots=True)
class Mount:
    """What a component knows of the vehicle that carries it."""

    state: VehicleState
    frame: LocalFrame
    clock: VehicleClock
    radio: Radio


class PayloadComponent(Protocol):
    """A device of its own: it has its own power and its state outlives a reboot of the autopilot."""

    component_id: int
    mav_type: int
    """MAV_TYPE of its heartbeat."""
    command: int
    """The MAV_CMD that it executes."""

    def execute(self, params: Params4, answer: Answer) -> None:
        """Params 1 to 4 of its command."""

    def step(self) -> None:
        """One step of vehicle time."""

    def status(self) -> Message | None:
        """What it tells of itself once a second, if it does."""
