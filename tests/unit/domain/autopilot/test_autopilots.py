"""Each known autopilot answers all that is asked of one, and notes what it assumes."""

from __future__ import annotations

import pytest

from app.domain.autopilot import Quantity, autopilot, autopilot_kind, behaviour, behaviour_of
from app.domain.vehicle.state import FIRMWARE, AutopilotKind, VehicleProfile, VehicleType


@pytest.mark.parametrize("kind", AutopilotKind)
@pytest.mark.parametrize("which", Quantity)
def test_a_quantity_that_is_not_told_is_the_default_and_noted_by_its_name(kind: AutopilotKind, which: Quantity) -> None:
    for vehicle_type in VehicleType:
        assumed: list[str] = []
        asked = behaviour(VehicleProfile(vehicle_type, assuming=assumed.append, autopilot=kind))
        name = asked.name_of(which)
        default = autopilot(kind).defaults[vehicle_type].get(name)
        assert asked.quantity(which) == (default or 0.0)
        assert assumed == ([] if default is None else [name])


@pytest.mark.parametrize("kind", AutopilotKind)
def test_a_quantity_that_is_told_is_taken_and_nothing_assumed(kind: AutopilotKind) -> None:
    name = behaviour_of(VehicleType.MULTICOPTER, None).name_of(Quantity.CLIMB_M_S)
    assumed: list[str] = []
    told = VehicleProfile(VehicleType.MULTICOPTER, parameters={name: 2.5}, assuming=assumed.append, autopilot=kind)
    assert (behaviour(told).quantity(Quantity.CLIMB_M_S), assumed) == (2.5, [])


@pytest.mark.parametrize("kind", AutopilotKind)
def test_an_autopilot_is_known_by_its_heartbeat(kind: AutopilotKind) -> None:
    assert autopilot_kind(autopilot(kind).mav_autopilot) is kind


@pytest.mark.parametrize("mav_autopilot", [0, 8, 250])
def test_one_that_is_not_known_has_no_kind(mav_autopilot: int) -> None:
    assert autopilot_kind(mav_autopilot) is None


def test_firmware_that_is_not_told_is_noted_where_an_answer_rests_on_it() -> None:
    assumed: list[str] = []
    asked = behaviour(VehicleProfile(VehicleType.MULTICOPTER, assuming=assumed.append))
    assert asked.needs_all_inclusions
    assert asked.too_old_for_drops is None
    assert not asked.returns_round_fence
    assert assumed == [FIRMWARE] * 3
