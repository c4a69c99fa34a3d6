"""The pulse of the gripper's output."""

from __future__ import annotations

from app.domain.autopilot.base import GripperChannel
from app.vehicles.decoders import ServoOutputRaw


def output_us(channel: GripperChannel | None, message: ServoOutputRaw) -> int | None:
    """The gripper's output in this message; None if it is for other outputs or carries none."""
    if channel is None or message.port != channel.port:
        return None
    return message.outputs_us[channel.output - 1] or None
