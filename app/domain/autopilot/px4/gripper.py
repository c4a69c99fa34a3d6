"""The output that moves the gripper, according to the parameters: the PWM_MAIN_FUNCn or PWM_AUX_FUNCn that is 430.

Pulses can be interpreted only with PX4's default limits (1000 us released, 2000 us grabbed). If an output is reversed
(PWM_*_REV) or has other limits (PWM_*_MINn, PWM_*_MAXn), it is ignored and drops rely on acknowledgements alone.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final

from app.domain.autopilot.base import GripperAssignment, GripperChannel
from app.domain.vehicle.state import VehicleProfile

GRIPPER_FUNCTION: Final = 430
"""PX4's output function (src/lib/mixer_module/output_functions.yaml)."""
OUTPUTS: Final = {"PWM_MAIN": (0, 16), "PWM_AUX": (1, 8)}
"""Parameter prefix: the SERVO_OUTPUT_RAW.port and the maximum number of outputs."""


def function_parameters() -> tuple[str, ...]:
    """Return the names of all parameters that may assign the gripper."""
    return tuple(f"{prefix}_FUNC{n}" for prefix, (_, count) in OUTPUTS.items() for n in range(1, count + 1))


def output(facts: VehicleProfile) -> GripperAssignment:
    """Parameters that did not answer are unknown, not 0."""
    silent = tuple(name for name in function_parameters() if name in facts.unanswered)
    assigned = is_assigned(facts.parameters, facts.unanswered)
    return GripperAssignment(assigned, silent, " or ".join(f"{prefix}_FUNCn" for prefix in OUTPUTS), GRIPPER_FUNCTION)


def is_assigned(parameters: Mapping[str, float | int], unanswered: Collection[str]) -> bool | None:
    """Whether a servo output is assigned to the gripper; None: unknown, because parameters did not answer."""
    names = function_parameters()
    if any(parameters.get(name) == GRIPPER_FUNCTION for name in names):
        return True
    return None if any(name in unanswered for name in names) else False


def limit_parameters(parameters: Mapping[str, float | int]) -> tuple[str, ...]:
    """Return the parameters that define the pulses of the assigned output."""
    found = _assigned(parameters)
    return () if found is None else tuple(f"{found[0]}_{name}" for name in ("REV", f"MIN{found[2]}", f"MAX{found[2]}"))


def gripper_channel(parameters: Mapping[str, float | int]) -> GripperChannel | None:
    """Return the gripper's channel, None if no output is assigned or its pulses cannot be interpreted."""
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
    """Return prefix, port and number of the gripper output."""
    for prefix, (port, count) in OUTPUTS.items():
        for output in range(1, count + 1):
            if parameters.get(f"{prefix}_FUNC{output}") == GRIPPER_FUNCTION:
                return prefix, port, output
    return None
