"""The PARAM protocol's rules beyond reading and setting one."""

from __future__ import annotations

import pytest

from app.simulator.dialect import Message, mavlink
from tests.unit.simulator.cockpit import Cockpit

READ, SET, LIST = "read", "set", "list"


@pytest.fixture
def cockpit() -> Cockpit:
    cockpit = Cockpit(ready=False)
    cockpit.fly(3.0)
    return cockpit


def send(cockpit: Cockpit, what: str, system: int = 1, component: int = 1) -> None:
    target = (system, component)
    messages = {
        READ: mavlink.MAVLink_param_request_read_message(*target, b"NAV_ACC_RAD", -1),
        SET: mavlink.MAVLink_param_set_message(*target, b"NAV_ACC_RAD", 3.0, 9),
        LIST: mavlink.MAVLink_param_request_list_message(*target),
    }
    cockpit.send(messages[what])
    cockpit.fly(0.1)


@pytest.mark.parametrize("what", [READ, SET, LIST])
@pytest.mark.parametrize(
    ("system", "component", "heard"), [(1, 1, True), (1, 0, True), (0, 0, True), (2, 1, False), (1, 169, False)]
)
def test_it_answers_what_is_for_the_autopilot(
    cockpit: Cockpit, what: str, system: int, component: int, heard: bool
) -> None:
    send(cockpit, what, system, component)
    assert bool(cockpit.messages("PARAM_VALUE")) is heard


@pytest.mark.parametrize("index", [9999, 32767])
def test_an_index_beyond_the_last_is_an_error(cockpit: Cockpit, index: int) -> None:
    cockpit.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", index))
    assert cockpit.last("PARAM_ERROR").error == 1
    assert cockpit.messages("PARAM_VALUE") == []


def test_a_set_is_told_to_every_link(cockpit: Cockpit) -> None:
    class Ear:
        gcs_heard_s: float | None = None

        def __init__(self) -> None:
            self.names: list[str] = []

        def send(self, message: Message, system_id: int, component_id: int) -> None:
            self.names.append(message.get_type())

    other = Ear()
    cockpit.vehicle.radio.channels.append(other)
    send(cockpit, SET)
    assert "PARAM_VALUE" in other.names


def test_a_second_list_request_begins_the_list_again(cockpit: Cockpit) -> None:
    send(cockpit, LIST)
    send(cockpit, LIST)
    cockpit.fly(1.0)
    indices = [value.param_index for value in cockpit.messages("PARAM_VALUE")]
    count = cockpit.last("PARAM_VALUE").param_count
    assert indices[-count:] == list(range(count))
    assert count < len(indices) < 2 * count


def test_out_of_range_values_are_taken(cockpit: Cockpit) -> None:
    """Scenario 01: COM_OBL_RC_ACT=99."""
    cockpit.send(mavlink.MAVLink_param_set_message(1, 1, b"NAV_ACC_RAD", -1e30, 9))
    assert cockpit.vehicle.params["NAV_ACC_RAD"] == pytest.approx(-1e30)
