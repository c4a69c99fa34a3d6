"""The gripper inside a task: commanded once the vehicle stands at the place; the vehicle's final answer ends it."""

from __future__ import annotations

from contextlib import aclosing
from typing import Final, Literal

from app.domain.commands import CommandRequest, MavResult
from app.domain.errors import LinkError, VehicleRefusedError
from app.domain.mission import NAN, MavCmd
from app.domain.ports import VehicleLink

Action = Literal["release", "grab"]
PARAM2: Final[dict[Action, float]] = {"release": 0.0, "grab": 1.0}
"""DO_GRIPPER's param2. Never NaN: PX4 would deny it, and 0 means RELEASE."""
IN_PROGRESS_S: Final = 15.0
STANDS_M_S: Final = 0.5


async def work_gripper(link: VehicleLink, action: Action) -> None:
    """Return when the vehicle has ACCEPTED it. Sent once: whether to try again is the pilot's decision.

    Raises:
        VehicleRefusedError: another final answer; LinkTimeoutError: none, so that it may have acted all the same.
    """
    request = CommandRequest(
        MavCmd.DO_GRIPPER,
        (1.0, PARAM2[action], NAN, NAN, NAN, NAN, NAN),
        attempts=1,
        in_progress_timeout_s=IN_PROGRESS_S,
    )
    async with aclosing(link.command(request)) as acks:
        async for ack in acks:
            final = ack
    if not final.is_final:
        raise LinkError("the acks of the gripper ended without a final one")
    if final.result is not MavResult.ACCEPTED:
        raise VehicleRefusedError(f"the gripper's {action} was answered {final.word}", result=final.word)
