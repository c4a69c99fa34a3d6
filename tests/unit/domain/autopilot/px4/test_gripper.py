"""The gripper's output is looked at only where its pulses mean what they mean by default."""

from __future__ import annotations

import pytest

from app.domain.autopilot.base import GripperChannel
from app.domain.autopilot.px4.gripper import gripper_channel, limit_parameters

ASSIGNED = {"PWM_AUX_FUNC3": 430, "PWM_MAIN_FUNC3": 101}


def test_the_assigned_output_is_found() -> None:
    assert gripper_channel(ASSIGNED) == GripperChannel(port=1, output=3)
    assert gripper_channel({"PWM_MAIN_FUNC5": 430}) == GripperChannel(port=0, output=5)
    assert gripper_channel({"PWM_MAIN_FUNC5": 402}) is None


def test_what_must_be_read_to_understand_it() -> None:
    assert limit_parameters(ASSIGNED) == ("PWM_AUX_REV", "PWM_AUX_MIN3", "PWM_AUX_MAX3")
    assert limit_parameters({}) == ()


@pytest.mark.parametrize("other", [{"PWM_AUX_REV": 0b100}, {"PWM_AUX_MIN3": 1100}, {"PWM_AUX_MAX3": 1900}])
def test_an_output_with_another_meaning_is_no_evidence(other: dict[str, int]) -> None:
    assert gripper_channel({**ASSIGNED, **other}) is None


def test_the_settings_of_another_output_do_not_matter() -> None:
    assert gripper_channel({**ASSIGNED, "PWM_AUX_REV": 0b011, "PWM_MAIN_MIN3": 1100}) is not None
