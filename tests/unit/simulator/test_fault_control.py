"""The control socket: every fault has a name, every mistake an answer, and nothing crashes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.simulator.fault_control import ControlServer, FaultControl
from app.simulator.fleet import Fleet
from app.simulator.options import Options, VehicleOptions

FLEET = (VehicleOptions("quad", 1), VehicleOptions("quad", 7, winch=True))


@pytest.fixture
async def fleet() -> AsyncIterator[Fleet]:
    fleet = Fleet(Options(fleet=FLEET, port=24_990, local_port=0))
    await fleet.open()
    yield fleet
    fleet.close()


async def ask(fleet: Fleet, **request: Any) -> dict[str, Any]:
    return await FaultControl(fleet).handle(request)


@pytest.mark.parametrize(
    ("fault", "value", "look"),
    [
        ("loss", 0.25, lambda v: v.faults.link.loss == 0.25),
        ("delay_s", 0.5, lambda v: v.faults.link.delay_s == 0.5),
        ("jitter_s", 0.5, lambda v: v.faults.link.jitter_s == 0.5),
        ("duplicate", 1, lambda v: v.faults.link.duplicate == 1.0),
        ("reorder", 1, lambda v: v.faults.link.reorder == 1.0),
        ("link_cut", True, lambda v: v.faults.link.link_cut),
        ("refuse_upload", 4, lambda v: v.faults.refuse_upload == 4),
        ("lost_ack", 2, lambda v: v.faults.lost_acks == 2),
        ("stuck_gripper", True, lambda v: v.faults.stuck_gripper),
        ("no_gripper", True, lambda v: v.faults.no_gripper),
        ("slow_gripper", 3, lambda v: v.faults.slow_gripper_s == 3.0),
        ("gps_loss", True, lambda v: v.faults.gps_lost),
        ("range_loss", True, lambda v: v.faults.range_lost),
        ("battery_percent", 12, lambda v: v.state.status.battery_fraction == pytest.approx(0.12)),
        ("wind", [3, -2], lambda v: (v.faults.wind_north_m_s, v.faults.wind_east_m_s) == (3.0, -2.0)),
        ("mode", "POSCTL", lambda v: v.state.status.mode.name == "POSCTL"),
    ],
)
async def test_each_fault_strikes_the_vehicle_it_names(fleet: Fleet, fault: str, value: Any, look: Any) -> None:
    before = [look(vehicle) for vehicle in fleet.vehicles]
    assert before == [False, False]
    assert await ask(fleet, vehicle=7, fault=fault, value=value) == {"ok": True}
    assert [bool(look(vehicle)) for vehicle in fleet.vehicles] == [False, True]
    assert await ask(fleet, vehicle=None, fault=fault, value=value) == {"ok": True}
    assert all(look(vehicle) for vehicle in fleet.vehicles)


async def test_a_second_ground_station_replaces_the_mission_and_blocks_a_transfer(fleet: Fleet) -> None:
    vehicle = fleet.vehicles[0]
    assert await ask(fleet, vehicle=1, fault="second_gcs", value="upload") == {"ok": True}
    assert len(vehicle.store.mission) == 2
    await ask(fleet, vehicle=1, fault="second_gcs", value="clear")
    assert len(vehicle.store.mission) == 0
    await ask(fleet, vehicle=1, fault="second_gcs", value="open_transfer")
    assert await ask(fleet, vehicle=1, fault="second_gcs", value="clear") == {"ok": True}
    assert len(vehicle.store.mission) == 0


async def test_a_twin_with_the_same_system_id_has_another_uid_and_can_be_silenced(fleet: Fleet) -> None:
    assert await ask(fleet, vehicle=1, fault="duplicate_sysid", value=True) == {"ok": True}
    twin = fleet.duplicates_of(1)[0]
    assert twin.system_id == 1
    assert twin.identity.uid != fleet.vehicles[0].identity.uid
    await ask(fleet, vehicle=1, fault="duplicate_sysid", value=False)
    assert twin.radio.silent
    assert fleet.duplicates_of(1) == []


async def test_a_stuck_winch_needs_a_winch(fleet: Fleet) -> None:
    assert (await ask(fleet, vehicle=7, fault="stuck_winch", value=True))["ok"]
    assert "no winch" in (await ask(fleet, vehicle=1, fault="stuck_winch", value=True))["error"]


async def test_the_state_can_be_asked_for(fleet: Fleet) -> None:
    answer = await ask(fleet, vehicle=7, query="state")
    assert [vehicle["vehicle"] for vehicle in answer["vehicles"]] == [7]
    assert answer["vehicles"][0]["landed_state"] == "ON_GROUND"
    assert answer["speed"] == {"wanted": 1.0, "achieved": None, "behind": False, "lost_s": 0.0, "latest_s": 0.0}
    json.dumps(answer)


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        ([1], "JSON object"),
        ({}, "unknown fault None"),
        ({"fault": "loss", "value": 2}, "not between"),
        ({"fault": "loss", "value": 10**400}, "not between"),
        ({"speed": 10**400}, "not between"),
        ({"fault": "loss", "value": "much"}, "not a number"),
        ({"fault": "loss", "value": True}, "not a number"),
        ({"fault": "loss", "value": float("nan")}, "not a number"),
        ({"fault": "link_cut", "value": 1}, "not true or false"),
        ({"fault": "wind", "value": [1]}, "[north, east]"),
        ({"fault": "mode", "value": "FLY"}, "unknown mode"),
        ({"fault": "second_gcs", "value": 3}, "unknown action"),
        ({"vehicle": 99, "fault": "loss", "value": 0.1}, "no vehicle"),
        ({"query": "secrets"}, "unknown query"),
    ],
)
async def test_a_mistake_is_answered_with_its_reason(fleet: Fleet, request_: Any, reason: str) -> None:
    answer = await FaultControl(fleet).handle(request_)
    assert answer["ok"] is False
    assert reason in answer["error"]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
NAMES = ["loss", "wind", "mode", "reorder", "refuse_upload", "battery_percent", "lost_ack", "stuck_gripper", "x"]


@given(fault=st.sampled_from(NAMES) | JSON, value=JSON, vehicle=st.none() | st.just(7) | JSON)
async def test_whatever_is_asked_there_is_an_answer(fault: Any, value: Any, vehicle: Any) -> None:
    fleet = Fleet(Options(fleet=FLEET))
    answer = await FaultControl(fleet).handle({"fault": fault, "value": value, "vehicle": vehicle})
    assert isinstance(answer["ok"], bool)


async def test_lines_in_lines_out_over_tcp(fleet: Fleet) -> None:
    server = ControlServer(FaultControl(fleet))
    port = await server.open(0)
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(b'{"vehicle": 7, "fault": "loss", "value": 0.5}\nnot json\n[[[[\n{"query": "state"}\n')
    answers = [json.loads(await reader.readline()) for _ in range(4)]
    assert [answer["ok"] for answer in answers] == [True, False, False, True]
    assert fleet.vehicles[1].faults.link.loss == 0.5
    writer.write(b"x" * 200_000)
    with suppress(ConnectionResetError):
        assert await reader.read() == b"", "a line without an end is cut off"
    writer.close()
    await server.close()
