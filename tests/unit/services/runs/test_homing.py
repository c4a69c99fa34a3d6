"""A rover's return that is repeated goes to where the rover took off: home is set back there before."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace

import pytest

from app.domain.errors import LinkError, LinkTimeoutError
from app.domain.events.run import CommandOutcome, RunAck, RunCommand, RunCommandName
from app.domain.mission import MissionItem, MissionType
from app.domain.reasons import ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode, GlobalPosition, LandedState
from tests.support.run_service import RunService, restarted, run_service

HOME = GlobalPosition(47.397742, 8.545594, 488.0)
MOVED = replace(HOME, latitude_deg=47.3979)


async def flying(service: RunService) -> None:
    await service.create()
    await service.until_state(RunState.FLYING)
    service.vehicle.put(landed=LandedState.IN_AIR, home=HOME)
    await service.until(lambda: service.newest.home == HOME, "home of its takeoff is known")
    service.vehicle.sent.clear()


@pytest.fixture
async def driving() -> AsyncIterator[RunService]:
    """A rover on its way."""
    async with run_service("rover-drop.json") as service:
        await flying(service)
        yield service


def told(service: RunService, kind: type[RunCommand | RunAck]) -> list[RunCommand | RunAck]:
    data = [event.data for event in service.events.events]
    return [one for one in data if isinstance(one, kind) and one.command is RunCommandName.DO_SET_HOME]


async def test_a_first_return_goes_home_by_itself(driving: RunService) -> None:
    await driving.runs.return_to_launch(driving.run_id)
    assert driving.vehicle.sent == ["return"]


@pytest.mark.parametrize("is_told", [True, False], ids=["told", "not told yet"])
async def test_a_return_that_is_repeated_goes_to_the_home_of_the_takeoff(driving: RunService, is_told: bool) -> None:
    """HOME_POSITION comes once a second. Home of the rover is PX4's own again afterwards."""
    await driving.runs.return_to_launch(driving.run_id)
    await driving.until_state(RunState.RETURNING)
    await driving.runs.pause(driving.run_id)
    if is_told:
        driving.vehicle.put(home=MOVED)
    driving.vehicle.sent.clear()
    await driving.runs.return_to_launch(driving.run_id)
    assert driving.vehicle.sent == ["home 0", "return", "home 1"]
    commands = [one.params for one in told(driving, RunCommand) if isinstance(one, RunCommand)]
    assert commands[0] == (0.0, None, None, None, HOME.latitude_deg, HOME.longitude_deg, HOME.altitude_m)


@pytest.mark.parametrize("answer", [MavResult.DENIED, LinkTimeoutError("no ack")])
async def test_a_home_that_is_not_set_holds_no_return_up_and_is_recorded(
    driving: RunService, answer: MavResult | LinkError
) -> None:
    driving.vehicle.put(home=MOVED)
    driving.vehicle.home_answers = [answer]
    await driving.runs.return_to_launch(driving.run_id)
    assert driving.vehicle.sent == ["home 0", "return"]
    (ack,) = (one for one in told(driving, RunAck) if isinstance(one, RunAck))
    assert ack.outcome is CommandOutcome.FAILED or ack.result is MavResult.DENIED


async def test_a_home_that_could_not_be_let_go_is_let_go_with_the_next_return(driving: RunService) -> None:
    driving.vehicle.put(home=MOVED)
    driving.vehicle.home_answers = [MavResult.ACCEPTED, LinkTimeoutError("no ack")]
    await driving.runs.return_to_launch(driving.run_id)
    driving.vehicle.put(home=HOME, mode=FlightMode.MISSION)
    await driving.until_state(RunState.FLYING)
    driving.vehicle.sent.clear()
    await driving.runs.return_to_launch(driving.run_id)
    assert driving.vehicle.sent == ["return", "home 1"]


async def test_home_of_what_flies_is_left_alone() -> None:
    """PX4 moves it for rovers only: what flies takes off once."""
    async with run_service() as service:
        await flying(service)
        service.vehicle.put(home=MOVED)
        await service.runs.return_to_launch(service.run_id)
        assert service.vehicle.sent == ["return"]


async def test_an_abort_of_a_run_that_is_not_followed_returns_to_the_home_of_its_takeoff(
    driving: RunService, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a restart of Waydrop its mission cannot be read; what the rover did meanwhile is not known."""

    async def download(mission_type: MissionType) -> tuple[MissionItem, ...]:
        raise LinkTimeoutError("the mission list could not be read back")

    await driving.runs.return_to_launch(driving.run_id)
    await driving.until_state(RunState.RETURNING)
    monkeypatch.setattr(driving.vehicle, "download", download)
    await restarted(driving, meanwhile=lambda: driving.vehicle.put(mission_id=None, home=MOVED))
    unread = ReasonCode.MISSION_UNREAD
    await driving.until(lambda: driving.run.reason is not None and driving.run.reason.code is unread, "it says so")
    driving.vehicle.sent.clear()
    await driving.runs.abort(driving.run_id)
    assert driving.vehicle.sent == ["home 0", "return", "home 1"]
    assert [type(one) for one in told(driving, RunCommand)] == [RunCommand] * 2
