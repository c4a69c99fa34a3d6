"""A photo: one picture at the stop before it, and evidence of the nearest drop."""

from __future__ import annotations

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import MOST_PICTURES, DropRecord
from app.domain.mission import MavCmd
from app.domain.plan.compiler import compile_plan
from app.domain.prediction import predict
from app.domain.vehicle.state import Picture, VehicleState
from tests.support.plan_pieces import gripper, multicopter, waypoint

PHOTO = {"type": "photo"}
RECORD = DropRecord(plan_item_id="drop", supervised=True)
PICTURE = Picture(1, True, 47.0, 8.0, 500.0, "mavlinkftp:/DCIM/0001.jpg")


def test_it_is_one_picture_of_all_cameras_where_the_vehicle_is() -> None:
    plan = multicopter(waypoint(), gripper(), PHOTO)
    mission = compile_plan(plan, default_facts(plan.vehicle_type))
    (item,) = [item for item in mission.items if item.command is MavCmd.IMAGE_START_CAPTURE]
    assert (item.param1, item.param2, item.param3, item.param4) == (0.0, 0.0, 1.0, 0.0)
    assert mission.drops[0].resume_seq == item.seq, "it is taken after the release"


def test_it_takes_no_time_and_moves_nothing() -> None:
    plan = multicopter(waypoint(), PHOTO, waypoint(50))
    entry = predict(plan, default_facts(plan.vehicle_type)).entries[2]
    assert (entry.type, entry.duration_s, entry.distance_m) == ("photo", 0.0, 0.0)


@pytest.mark.parametrize("before", [VehicleState(), VehicleState(picture=Picture(0, True, 0.0, 0.0, 0.0))])
def test_what_a_camera_tells_between_two_looks_is_evidence_once(before: VehicleState) -> None:
    now = VehicleState(picture=PICTURE)
    record = RECORD.having_seen(before, now)
    assert record.pictures == (PICTURE,)
    assert record.having_seen(before, now) is record
    assert DropRecord.model_validate_json(record.model_dump_json()) == record


def test_a_picture_from_before_the_first_look_is_no_evidence() -> None:
    seen = VehicleState(picture=PICTURE)
    assert RECORD.having_seen(seen, seen) is RECORD


def test_a_record_names_so_many_pictures_and_no_more() -> None:
    record = RECORD
    for index in range(MOST_PICTURES + 3):
        record = record.having_seen(VehicleState(), VehicleState(picture=Picture(index, True, 47.0, 8.0, 500.0)))
    assert len(record.pictures) == MOST_PICTURES
