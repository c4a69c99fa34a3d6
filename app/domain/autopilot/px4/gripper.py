"""Which output moves the gripper, as far as the parameters tell."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final

from app.domain.autopilot.base import GripperOutput
from app.domain.vehicle import VehicleFacts

GRIPPER_FUNCTION: Final = 430
"""PX4's output function (src/lib/mixer_module/output_functions.yaml)."""
OUTPUTS: Final = {"PWM_MAIN": (0, 16), "PWM_AUX": (1, 8)}
"""Parameter prefix: SERVO_OUTPUT_RAW.port and how many outputs there may be."""


def function_parameters() -> tuple[str, ...]:
    """The names of all parameters that may assign the gripper."""
    return tuple(f"{prefix}_FUNC{n}" for prefix, (_, count) in OUTPUTS.items() for n in range(1, count + 1))


def output(facts: VehicleFacts) -> GripperOutput:
    """Parameters that did not answer are not the same as 0."""
    silent = tuple(name for name in function_parameters() if name in facts.unanswered)
    assigned = is_assigned(facts.parameters, facts.unanswered)
    return GripperOutput(assigned, silent, " or ".join(f"{prefix}_FUNCn" for prefix in OUTPUTS), GRIPPER_FUNCTION)


def is_assigned(parameters: Mapping[str, float | int], unanswered: Collection[str]) -> bool | None:
    """Whether a servo output is assigned to the gripper; None: not known, since parameters did not answer."""
    names = function_parameters()
    if any(parameters.get(name) == GRIPPER_FUNCTION for name in names):
        return True
    return None if any(name in unanswered for name in names) else False
