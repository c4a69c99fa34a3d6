"""Which servo output moves the gripper: the one whose PWM_MAIN_FUNCn or PWM_AUX_FUNCn is 430."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

from app.vehicles.decoders import ServoOutputRaw

GRIPPER_FUNCTION: Final = 430
OUTPUTS: Final = {"PWM_MAIN_FUNC": (0, 16), "PWM_AUX_FUNC": (1, 8)}
"""Parameter prefix: SERVO_OUTPUT_RAW.port and how many outputs there may be."""


class GripperChannel(NamedTuple):
    """SERVO_OUTPUT_RAW's port and output, counted from 1."""

    port: int
    output: int


def function_parameters() -> tuple[str, ...]:
    """The names of all parameters that may assign the gripper."""
    return tuple(f"{prefix}{n}" for prefix, (_, count) in OUTPUTS.items() for n in range(1, count + 1))


def gripper_channel(parameters: Mapping[str, float | int]) -> GripperChannel | None:
    """The gripper's channel; None if no output is assigned to it."""
    for prefix, (port, count) in OUTPUTS.items():
        for output in range(1, count + 1):
            if parameters.get(f"{prefix}{output}") == GRIPPER_FUNCTION:
                return GripperChannel(port, output)
    return None


def output_us(channel: GripperChannel | None, message: ServoOutputRaw) -> int | None:
    """The gripper's output in this message; None if it is for other outputs or carries none."""
    if channel is None or message.port != channel.port:
        return None
    return message.outputs_us[channel.output - 1] or None
