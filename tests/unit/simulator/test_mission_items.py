"""Which items are taken, refused or changed, and the ids of what is stored (scenarios 03, 05, 06)."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import mavlink
from app.simulator.mission.item import Item
from app.simulator.mission.store import plan_of
from app.simulator.wire import Cmd, MissionAck
from tests.support.mission_steps import acks, count
from tests.support.simulated_vehicle import GroundStation, Plan, do, takeoff


@pytest.fixture
def gcs() -> GroundStation:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    return gcs


@pytest.mark.parametrize(
    ("plan", "answer"),
    [
        (Plan(Cmd.DO_GRIPPER, params=(1, 0, 0, 0), frame=6), MissionAck.INVALID_PARAM5_X),
        (Plan(9999), MissionAck.UNSUPPORTED),
        (Plan(42), MissionAck.UNSUPPORTED),
        (Plan(82, 10, 0, 15), MissionAck.UNSUPPORTED),
        (Plan(94, 10, 0, 15), MissionAck.UNSUPPORTED),
        (Plan(18, 10, 0, 15), MissionAck.UNSUPPORTED),
        (Plan(16, 10, 0, 15, frame=8), MissionAck.UNSUPPORTED_FRAME),
        (Plan(16, 10, 0, 15, frame=1), MissionAck.UNSUPPORTED_FRAME),
        (Plan(16, 10, 0, 15, frame=10), MissionAck.UNSUPPORTED_FRAME),
        (Plan(5001, 10, 0, 0, (4, 0, 0, 0)), MissionAck.ERROR),
        (Plan(16, 10, 0, 15, (0, 0, 7, 0)), MissionAck.INVALID_PARAM1 + 2),
        (Plan(16, 10, 0, 15, (0, 0, math.nan, math.nan)), MissionAck.ACCEPTED),
        (Plan(16, 10, 0, 15, frame=5), MissionAck.ACCEPTED),
        (Plan(16, 10, 0, math.nan), MissionAck.ACCEPTED),
        (do(Cmd.NAV_DELAY, 3), MissionAck.ACCEPTED),
        (do(Cmd.DO_WINCH, 1, 4, 5, 1), MissionAck.ACCEPTED),
        (do(Cmd.DO_GRIPPER, 7, 5), MissionAck.ACCEPTED),
    ],
)
def test_items_are_taken_or_refused_as_recorded(gcs: GroundStation, plan: Plan, answer: int) -> None:
    if plan.command == Cmd.DO_GRIPPER and plan.frame == 6:  # with a position, as a client would wrongly give it
        plan = Plan(plan.command, 10.0, 0.0, 0.0, plan.params, frame=6)
    assert gcs.upload([takeoff(15), plan]) == answer
    if answer not in (MissionAck.ACCEPTED, MissionAck.ERROR):
        assert gcs.texts()[-1] == "IGN MISSION_ITEM: Invalid item"


@pytest.mark.parametrize(("airframe", "answer"), [("quad", MissionAck.ACCEPTED), ("rover", MissionAck.INVALID_PARAM1)])
def test_a_takeoff_has_a_pitch_but_for_a_rovers(airframe: str, answer: int) -> None:
    assert GroundStation(airframe, ready=False).upload([takeoff(15, pitch_deg=10.0)]) == answer


def test_float_items_are_taken(gcs: GroundStation) -> None:
    count(gcs, 1)
    gcs.send(mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 22, 0, 1, 0, 0, 0, math.nan, 47.39775, 8.54559, 15, 0))
    assert acks(gcs) == [(245, MissionAck.ACCEPTED)]
    assert gcs.vehicle.store.mission.items[0].latitude_deg == pytest.approx(47.39775, abs=1e-5)


def test_a_polygon_of_two_vertices_is_an_error(gcs: GroundStation) -> None:
    assert gcs.upload([Plan(5001, 0, 0, 0, (2, 0, 0, 0))] * 2, 1) == MissionAck.ERROR


def test_fence_and_rally_have_ids_of_their_own_and_a_fence_forgets_frame_and_autocontinue(gcs: GroundStation) -> None:
    square = [Plan(5001, n, e, 0, (4, 0, 0, 0)) for n, e in ((-50, -50), (50, -50), (50, 50), (-50, 50))]
    assert gcs.upload(square, 1) == MissionAck.ACCEPTED
    assert gcs.upload([Plan(5100, 30, 30, 20, (0, 0, 0, 0))], 2) == MissionAck.ACCEPTED
    gcs.fly(1.1)
    current = gcs.last("MISSION_CURRENT")
    assert 0 not in (current.fence_id, current.rally_points_id)
    assert current.mission_id == 0
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 1))
    gcs.send(mavlink.MAVLink_mission_request_int_message(1, 1, 0, 1))
    item = gcs.last("MISSION_ITEM_INT")
    assert (item.command, item.frame, item.autocontinue, item.param1) == (5001, 5, 0, 4)


def test_the_mission_id_is_the_one_px4_computes() -> None:
    """The five items of scenario 06 and the id that PX4 gave them."""
    nan = math.nan
    items = [
        Item(22, 6, 1, 0, 0, 0, nan, 473977428, 85455944, 15),
        Item(16, 6, 1, 0, 0, 0, nan, 473982818, 85455944, 15),
        Item(211, 2, 1, 1, 0, 0, 0, 0, 0, 0),
        Item(16, 6, 1, 0, 0, 0, nan, 473982818, 85461916, 15),
        Item(20, 2, 1, 0, 0, 0, 0, 0, 0, 0),
    ]
    assert plan_of(items).plan_id == 3292353930
