"""A camera component: PX4's navigator shoots, it answers and says where."""

from __future__ import annotations

import pytest

from app.simulator.external.others import CAMERA_COMPONENT
from app.simulator.wire import Cmd
from tests.support.simulated_vehicle import METRES_PER_DEGREE, GroundStation, do, takeoff, waypoint

PHOTO = do(Cmd.IMAGE_START_CAPTURE, 0.0, 0.0, 1.0, 0.0)


def test_a_missions_photo_is_shot_by_the_autopilot_and_told_by_the_camera() -> None:
    gcs = GroundStation(others=("camera",))
    home_deg = gcs.last("GLOBAL_POSITION_INT").lat / 1e7
    gcs.start([takeoff(10), waypoint(30, 0, 10, hold_s=3, radius_m=1), PHOTO, waypoint(60, 0, 10)])
    gcs.until(lambda: gcs.messages("CAMERA_IMAGE_CAPTURED"))
    gcs.fly(5.0)
    (told,) = [received for received in gcs.received if received.name == "CAMERA_IMAGE_CAPTURED"]
    assert (told.component, told.message.image_index, told.message.capture_result) == (CAMERA_COMPONENT, 1, 1)
    north_m = (told.message.lat / 1e7 - home_deg) * METRES_PER_DEGREE
    assert (north_m, told.message.relative_alt / 1e3) == (pytest.approx(30.0, abs=1.5), pytest.approx(10.0, abs=1.0))
    shots = [one for one in gcs.messages("COMMAND_LONG") if one.command == Cmd.DO_DIGICAM_CONTROL]
    assert {(one.param5, one.target_system) for one in shots} == {(1.0, 1)}


def test_without_a_camera_the_mission_goes_on_and_nobody_tells() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(10), waypoint(30, 0, 10), PHOTO, waypoint(60, 0, 10)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 3)
    assert gcs.messages("CAMERA_IMAGE_CAPTURED") == []
