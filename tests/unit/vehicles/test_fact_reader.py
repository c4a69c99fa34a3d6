"""The parameters of a vehicle, read and read again: what it has is known, and its age is true."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping

import pytest

from app.domain.errors import LinkError
from app.domain.vehicle.state import GlobalPosition
from app.vehicles.decoders import AutopilotVersion, Heartbeat
from app.vehicles.encoders import Outgoing, ParamRequestRead
from app.vehicles.facts import FactReader, Identity
from app.vehicles.inbox import Inbox
from app.vehicles.measurements import Measurements
from app.vehicles.parameters import ParameterReader, Value
from app.vehicles.settings import LinkSettings

NOT_LOOKED_UP = 65535
"""param_index of a parameter whose changes PX4 does not announce."""


class Telling:
    """A vehicle with a few parameters. `mute` are those of which no answer arrives, now."""

    def __init__(self, timeout_s: float = 0.05, attempts: int = 2) -> None:
        self.values = {"NAV_ACC_RAD": 10.0, "MIS_DIST_1WP": 900.0, "_HASH_CHECK": 1.0}
        self.mute: set[str] = set()
        self.unannounced: set[str] = set()
        self.asked: list[str] = []
        self.news: list[Mapping[str, Value]] = []
        self.inbox = Inbox(asyncio.get_running_loop(), capacity=512)
        settings = LinkSettings(parameter_timeout_s=timeout_s, parameter_attempts=attempts)
        measurements, identity = Measurements(), Identity(lambda message: None, settings)
        measurements.take_heartbeat(Heartbeat(2, 12, 1, 0, 3), 1.0)
        measurements.home = GlobalPosition(47.0, 8.0, 400.0)
        identity.take(AutopilotVersion(flight_sw_version=0x011300FF, uid=1, uid2=()), 1.0)
        reader = ParameterReader(self._take, lambda name: None, self.inbox, settings)
        self.facts = FactReader(measurements, identity, reader, self.inbox, self.news.append)

    def set(self, name: str, value: float) -> None:
        """Somebody else sets it, and the vehicle announces it."""
        self.values[name] = value
        self._tell(name)

    def _take(self, message: Outgoing) -> None:
        assert isinstance(message, ParamRequestRead)
        self.asked.append(message.param_id)
        if message.param_id in self.mute:
            return
        if message.param_id in self.values:
            self._tell(message.param_id)
        else:
            answer = {"target_system": 245, "target_component": 190, "param_id": message.param_id, "error": 1}
            self.inbox.post("PARAM_ERROR", json.dumps(answer))

    def _tell(self, name: str) -> None:
        index = NOT_LOOKED_UP if name in self.unannounced else 3
        told = {"param_id": name, "param_type": 9, "param_value": self.values[name], "param_index": index}
        self.inbox.post("PARAM_VALUE", json.dumps(told))


async def turns() -> None:
    """What was posted is handled."""
    await asyncio.sleep(0.02)


async def test_a_vehicle_that_restarts_while_a_start_reads_again_gives_no_facts_of_defaults_alone() -> None:
    vehicle = Telling()
    assert (await vehicle.facts.read()).parameters["NAV_ACC_RAD"] == 10.0
    vehicle.mute = set(vehicle.values)
    reading = asyncio.create_task(vehicle.facts.read(fresh=True))
    await turns()
    vehicle.facts.forget()
    with pytest.raises(LinkError):
        await asyncio.wait_for(reading, 10.0)


async def test_one_that_restarts_meanwhile_and_answers_again_is_read_anew() -> None:
    vehicle = Telling()
    await vehicle.facts.read()
    vehicle.mute = {"_HASH_CHECK"}
    reading = asyncio.create_task(vehicle.facts.read(fresh=True))
    await turns()
    vehicle.facts.forget()
    vehicle.mute, vehicle.values["NAV_ACC_RAD"] = set(), 3.0
    assert (await asyncio.wait_for(reading, 10.0)).parameters["NAV_ACC_RAD"] == 3.0


async def test_fresh_parameters_that_cannot_be_read_are_an_error_and_not_the_old_ones() -> None:
    vehicle = Telling()
    await vehicle.facts.read()
    vehicle.mute = set(vehicle.values)
    with pytest.raises(LinkError, match="could not be read again"):
        await vehicle.facts.read(fresh=True)
    assert (await vehicle.facts.read()).parameters["NAV_ACC_RAD"] == 10.0, "a check tells the old ones, with their age"


@pytest.mark.parametrize("told", [False, True])
async def test_a_parameter_whose_answers_were_lost_at_first_is_known_once_it_is_told_or_asked_for_again(
    told: bool,
) -> None:
    vehicle = Telling()
    vehicle.mute = {"MIS_DIST_1WP"}
    first = await vehicle.facts.read()
    assert "MIS_DIST_1WP" not in first.parameters
    assert "MIS_DIST_1WP" in first.unanswered
    vehicle.mute = set()
    if told:
        vehicle.set("MIS_DIST_1WP", 50.0)
        await turns()
    else:
        vehicle.values["MIS_DIST_1WP"] = 50.0
    again = await vehicle.facts.read(fresh=not told)
    assert again.parameters["MIS_DIST_1WP"] == 50.0


async def test_the_grippers_output_is_known_once_its_parameter_answers() -> None:
    vehicle = Telling()
    vehicle.values |= {"PD_GRIPPER_TYPE": 0.0, "PWM_MAIN_FUNC5": 430.0}
    vehicle.mute = {"PWM_MAIN_FUNC5"}
    await vehicle.facts.read()
    assert vehicle.facts.has_gripper_output() is None
    vehicle.mute = set()
    await vehicle.facts.read(fresh=True)
    await turns()
    assert vehicle.facts.has_gripper_output() is True


async def test_an_announced_change_is_not_overwritten_by_an_answer_from_before_it() -> None:
    vehicle = Telling(timeout_s=0.3)
    await vehicle.facts.read()
    vehicle.facts.doubt()
    vehicle.mute = {"MIS_DIST_1WP"}  # its first answer is lost, so that the reading goes on
    reading = asyncio.create_task(vehicle.facts.read(fresh=True))
    await asyncio.sleep(0.1)  # within it the other has answered
    vehicle.set("NAV_ACC_RAD", 3.0)
    vehicle.mute = set()
    facts = await asyncio.wait_for(reading, 10.0)
    assert facts.parameters["NAV_ACC_RAD"] == 3.0
    assert vehicle.news == [{"NAV_ACC_RAD": 3.0}], "nobody has set it back"


async def test_a_fresh_reading_is_not_one_that_had_asked_before() -> None:
    vehicle = Telling(timeout_s=0.3, attempts=4)
    vehicle.unannounced = {"MIS_DIST_1WP"}
    await vehicle.facts.read()
    vehicle.facts.doubt()
    vehicle.mute = {"_HASH_CHECK"}
    checking = asyncio.create_task(vehicle.facts.read())
    await asyncio.sleep(0.1)  # by now the other has answered
    vehicle.values["MIS_DIST_1WP"] = 50.0
    starting = asyncio.create_task(vehicle.facts.read(fresh=True))
    await turns()
    vehicle.mute = set()
    assert (await starting).parameters["MIS_DIST_1WP"] == 50.0
    await checking
