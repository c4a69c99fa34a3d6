"""Which output of the autopilot moves the gripper, as far as its parameters tell."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final

from app.domain.vehicle import VehicleFacts

GRIPPER_FUNCTION: Final = 430
"""PX4's output function (src/lib/mixer_module/output_functions.yaml)."""
OUTPUTS: Final = {"PWM_MAIN": (0, 16), "PWM_AUX": (1, 8)}
"""Parameter prefix: SERVO_OUTPUT_RAW.port and how many outputs there may be."""


def function_parameters() -> tuple[str, ...]:
    """The names of all parameters that may assign the gripper."""
    return tuple(f"{prefix}_FUNC{n}" for prefix, (_, count) in OUTPUTS.items() for n in range(1, count + 1))


def has_gripper_output(facts: VehicleFacts) -> bool | None:
    """As is_assigned."""
    return is_assigned(facts.parameters, facts.unanswered)


def is_assigned(parameters: Mapping[str, float | int], unanswered: Collection[str]) -> bool | None:
    """Whether a servo output is assigned to the gripper; None: not known, since parameters did not answer."""
    names = function_parameters()
    if any(parameters.get(name) == GRIPPER_FUNCTION for name in names):
        return True
    return None if any(name in unanswered for name in names) else False


def unanswered_functions(facts: VehicleFacts) -> tuple[str, ...]:
    """The parameters that may assign it and did not answer: they are not the same as 0."""
    return tuple(name for name in function_parameters() if name in facts.unanswered)
