"""A gripper as a component of its own: unlike PX4's payload deliverer it knows whether it has moved.

The same conflict rules as the deliverer's; what differs is that a stuck gripper says FAILED.
"""

from __future__ import annotations

from dataclasses import dataclass

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message
from app.simulator.external.component import Answer, Params4
from app.simulator.faults import VehicleFaults
from app.simulator.state import GripperState
from app.simulator.wire import Cmd, Result

GRIPPER_COMPONENT = 158
"""MAV_COMP_ID_PERIPHERAL: MAVLink has no component id for grippers."""
MAV_TYPE_GRIPPER = 48
MOVING_S = 1.0
ACTIONS = {0.0: True, 1.0: False}
"""GRIPPER_ACTIONS, param2 of DO_GRIPPER: whether it releases."""


@dataclass(slots=True)
class _Action:
    release: bool
    end_s: float
    answer: Answer


class ExternalGripper:
    """Executes DO_GRIPPER: param2 0 releases, 1 grabs."""

    component_id = GRIPPER_COMPONENT
    mav_type = MAV_TYPE_GRIPPER
    command = int(Cmd.DO_GRIPPER)

    def __init__(self, gripper: GripperState, faults: VehicleFaults, clock: VehicleClock) -> None:
        self._gripper = gripper
        self._faults = faults
        self._clock = clock
        self._action: _Action | None = None

    def execute(self, params: Params4, answer: Answer) -> None:
        """One gripper: the instance in param1 is ignored."""
        release = ACTIONS.get(params[1])
        running = self._action
        if release is None:
            answer(Result.DENIED)
        elif running is not None and running.release == release:
            answer(Result.TEMPORARILY_REJECTED)
        elif running is None and self._gripper.output_released == release:
            answer(Result.ACCEPTED)
        else:
            if running is not None:
                running.answer(Result.CANCELLED)
            self._action = _Action(release, self._clock.now_s + MOVING_S + self._faults.slow_gripper_s, answer)
            answer(Result.IN_PROGRESS)

    def step(self) -> None:
        """End the movement, and say how it ended."""
        action = self._action
        if action is None or self._clock.now_s < action.end_s:
            return
        self._action = None
        if self._faults.stuck_gripper:
            action.answer(Result.FAILED)
            return
        self._gripper.released = self._gripper.output_released = self._gripper.is_open = action.release
        action.answer(Result.ACCEPTED)

    def status(self) -> Message | None:
        """MAVLink has no message for it."""
        return None
