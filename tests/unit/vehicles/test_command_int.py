"""Places go out as COMMAND_INT, as a real PX4 took them in the recordings (22_reposition_plane), and exactly."""

from __future__ import annotations

import json

import pytest

from app.domain.mission import MavCmd
from app.domain.offboard.tasks.commanded import CIRCLE_HERE, CircleAt, FlyTo, order_request
from app.vehicles.command_sender import _encoded
from app.vehicles.encoders import CommandInt, CommandLong
from tests.support.task_examples import ORIGIN

RECORDED = {
    "target_system": 6,
    "target_component": 1,
    "frame": 0,
    "command": 192,
    "current": 0,
    "autocontinue": 0,
    "param1": -1.0,
    "param2": 1.0,
    "param3": None,
    "param4": None,
    "x": 474004382,
    "y": 85455941,
    "z": 45.049,
}


def test_a_reposition_has_the_fields_that_were_recorded() -> None:
    nan = float("nan")
    sent = CommandInt(192, (-1.0, 1.0, nan, nan), 474004382, 85455941, 45.049)
    assert json.loads(sent.fields_json(6, 1)) == RECORDED


@pytest.mark.parametrize(
    ("order", "command"), [(FlyTo((10.0, 20.0), 50.0), MavCmd.DO_REPOSITION), (CircleAt((0.0, 0.0), 60.0, 50.0), 34)]
)
def test_an_order_with_a_place_is_a_command_int_above_sea_level(order: FlyTo | CircleAt, command: int) -> None:
    message = _encoded(order_request(order, ORIGIN), confirmation=0)
    assert isinstance(message, CommandInt)
    fields = json.loads(message.fields_json(1, 1))
    assert (fields["command"], fields["frame"], fields["z"]) == (int(command), 0, 538.0)
    assert isinstance(fields["x"], int)


def test_to_circle_here_is_a_command_long_without_a_place() -> None:
    message = _encoded(CIRCLE_HERE, confirmation=1)
    assert isinstance(message, CommandLong)
    fields = json.loads(message.fields_json(1, 1))
    assert [fields[f"param{n}"] for n in range(1, 8)] == [-1.0, 1.0, None, None, None, None, None]


def test_what_does_not_fit_is_not_sent() -> None:
    with pytest.raises(ValueError, match="signed 32-bit"):
        CommandInt(192, (0.0, 0.0, 0.0, 0.0), 1 << 31, 0, 0.0).fields_json(1, 1)
