"""What the control socket tells of faults, and that Waydrop knows the same faults with the same values."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.domain.ports.simulated_vehicles import FAULT_KINDS, FaultRequest
from app.simulator.fault_control import SECOND_GROUND_ACTIONS, FaultControl, lasting_faults
from app.simulator.fleet import Fleet
from app.simulator.options import Options, VehicleOptions
from app.simulator.wire import MissionAck, Mode
from tests.support.simulated_vehicle import GroundStation

LASTING: dict[str, tuple[Any, Any]] = {
    "loss": (0.25, 0.0),
    "duplicate": (1.0, 0.0),
    "reorder": (0.5, 0.0),
    "delay_s": (60.0, 0.0),
    "jitter_s": (0.5, 0.0),
    "link_cut": (True, False),
    "refuse_upload": (15, 0),
    "lost_ack": (1000, 0),
    "stuck_gripper": (True, False),
    "no_gripper": (True, False),
    "slow_gripper": (600.0, 0.0),
    "stuck_winch": (True, False),
    "gps_loss": (True, False),
    "range_loss": (True, False),
    "wind": ([-30.0, 30.0], [0.0, 0.0]),
    "duplicate_sysid": (True, False),
}
MOMENTS: dict[str, Any] = {"reboot": True, "battery_percent": 100.0, "mode": "RTL", "second_gcs": "clear"}


@pytest.fixture
async def fleet() -> AsyncIterator[Fleet]:
    options = Options(fleet=(VehicleOptions("quad", 1, winch=True),), port=33_581, local_port=0)
    fleet = Fleet(options)
    await fleet.open()
    yield fleet
    fleet.close()


async def ordered(fleet: Fleet, fault: str, value: Any) -> dict[str, Any]:
    """Give an order that Waydrop finds good; the faults that the simulator then tells."""
    order = FaultRequest.model_validate_json(json.dumps({"vehicle": "v1", "fault": fault, "value": value}))
    sent = order.root.model_dump(mode="json")["value"]
    control = FaultControl(fleet)
    assert await control.handle({"vehicle": 1, "fault": fault, "value": sent}) == {"ok": True}
    (state,) = (await control.handle({"query": "state"}))["vehicles"]
    return dict(state["faults"])


def test_waydrop_knows_the_faults_that_the_simulator_has(fleet: Fleet) -> None:
    assert {kind.fault for kind in FAULT_KINDS} == LASTING.keys() | MOMENTS.keys() == set(FaultControl(fleet).names)


@pytest.mark.parametrize("fault", LASTING)
async def test_a_lasting_fault_is_told_until_it_is_cleared(fleet: Fleet, fault: str) -> None:
    value, healthy = LASTING[fault]
    assert await ordered(fleet, fault, value) == {fault: value}
    assert await ordered(fleet, fault, healthy) == {}


def test_a_healthy_vehicle_without_a_winch_has_none() -> None:
    assert lasting_faults(GroundStation(ready=False).vehicle, has_duplicate=False) == {}


@pytest.mark.parametrize("fault", MOMENTS)
async def test_what_happens_once_does_not_last(fleet: Fleet, fault: str) -> None:
    assert await ordered(fleet, fault, MOMENTS[fault]) == {}


def test_modes_deeds_and_results_are_those_of_the_simulator() -> None:
    schemas = {kind.fault: kind.value_schema for kind in FAULT_KINDS}
    assert schemas["mode"]["enum"] == [mode.name for mode in Mode if mode is not Mode.DESCEND]
    assert tuple(schemas["second_gcs"]["enum"]) == SECOND_GROUND_ACTIONS
    assert schemas["refuse_upload"]["maximum"] == max(MissionAck)
