"""Which servo output moves the gripper: the one whose PWM_MAIN_FUNCn or PWM_AUX_FUNCn is 430.

What its pulse means is known only with PX4's plain settings (1000 us released, 2000 us grabbed): an output that is
reversed (PWM_*_REV) or has other limits (PWM_*_MINn, PWM_*_MAXn) is not looked at, and drops rest on acks alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from app.domain.autopilot.px4.gripper import GRIPPER_FUNCTION, OUTPUTS
from app.vehicles.decoders import ServoOutputRaw


class GripperChannel(NamedTuple):
    """SERVO_OUTPUT_RAW's port and output, counted from 1."""

    port: int
    output: int


def limit_parameters(parameters: Mapping[str, float | int]) -> tuple[str, ...]:
    """The names of the parameters that say what the pulses of the assigned output mean."""
    found = _assigned(parameters)
    return () if found is None else tuple(f"{found[0]}_{name}" for name in ("REV", f"MIN{found[2]}", f"MAX{found[2]}"))


def gripper_channel(parameters: Mapping[str, float | int]) -> GripperChannel | None:
    """The gripper's channel; None if no output is assigned to it, or its pulses have another meaning."""
    found = _assigned(parameters)
    if found is None:
        return None
    prefix, port, output = found
    reversed_outputs = int(parameters.get(f"{prefix}_REV", 0))
    lowest, highest = parameters.get(f"{prefix}_MIN{output}", 1000), parameters.get(f"{prefix}_MAX{output}", 2000)
    if reversed_outputs >> (output - 1) & 1 or (lowest, highest) != (1000, 2000):
        return None
    return GripperChannel(port, output)


def _assigned(parameters: Mapping[str, float | int]) -> tuple[str, int, int] | None:
    """Prefix, port and number of the gripper's output."""
    for prefix, (port, count) in OUTPUTS.items():
        for output in range(1, count + 1):
            if parameters.get(f"{prefix}_FUNC{output}") == GRIPPER_FUNCTION:
                return prefix, port, output
    return None


def output_us(channel: GripperChannel | None, message: ServoOutputRaw) -> int | None:
    """The gripper's output in this message; None if it is for other outputs or carries none."""
    if channel is None or message.port != channel.port:
        return None
    return message.outputs_us[channel.output - 1] or None
