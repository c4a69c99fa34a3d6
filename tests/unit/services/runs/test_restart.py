"""After a restart of ours a run goes on where its vehicle is, and nothing is started or released again."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import LinkTimeoutError, WrongStateError
from app.domain.reasons import describe
from app.domain.run.run import RunState
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import LandedState
from tests.support.runs_fixture import Desk, desk, restarted


async def land(at: Desk) -> None:
    at.vehicle.touch_down(complete=True, last_seq=len(at.mission.items) - 1)
    await at.until(lambda: at.run.is_over, "the run must end after the landing")


async def test_after_a_restart_the_run_goes_on_where_the_vehicle_is() -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await at.until(lambda: at.run.item_id == "corner", "progress must show")
        sent = list(at.vehicle.sent)
        await restarted(at)
        assert at.fleet.view("v1").run_id == at.run_id or at.runs.open_runs()
        await at.fly_to_drop()
        await at.until(lambda: at.drop.outcome is DropOutcome.RELEASED, "the taken-up run must drop")
        assert at.vehicle.sent == [*sent, "set_current 3"], "nothing is armed or started again"
        await land(at)
        assert at.run.state is RunState.COMPLETED
        assert at.run.flown_item_ids == ("takeoff", "corner", "clinic", "drop", "home")


async def test_after_a_restart_during_the_hold_its_end_is_counted_from_when_it_was_last_seen_waiting() -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.vehicle.put(mission_seq=2, landed=LandedState.IN_AIR)
        await at.until(lambda: at.run.item_id == "clinic", "progress must show")
        drop = at.mission.drops[0]
        await restarted(
            at, meanwhile=lambda: at.vehicle.put(latitude_deg=drop.latitude_deg, longitude_deg=drop.longitude_deg)
        )
        await at.until(lambda: at.drop.outcome is DropOutcome.RELEASED, "25 s of the hold are surely left")
        assert len(at.vehicle.releases) == 1


async def test_after_a_restart_a_commanded_release_is_not_sent_again() -> None:
    async with desk() as at:
        at.vehicle.answers = [LinkTimeoutError("killed meanwhile")] * 9
        at.vehicle.put(connected=True)
        await at.create()
        await at.fly_to_drop()
        await at.until(lambda: bool(at.vehicle.releases), "the release must be sent")
        await at.until(lambda: at.drop.attempts >= 1, "the release must be recorded")
        at.vehicle.releases.clear()
        await restarted(at)
        await at.until(lambda: at.drop.outcome is not DropOutcome.PENDING, "the drop must end")
        assert at.vehicle.releases == []
        assert at.drop.outcome is DropOutcome.UNKNOWN


async def test_after_a_restart_a_vehicle_with_another_mission_is_not_followed() -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.vehicle.on_board = at.vehicle.on_board[:-1]
        await restarted(at)
        await at.until_state(RunState.FAILED)
        assert "the mission on board is not" in describe(at.run.reason)


async def test_after_a_restart_during_an_upload_nothing_is_started() -> None:
    async with desk() as at:
        at.vehicle.upload_gate.clear()
        await at.create()
        await at.until(lambda: at.run.state is RunState.UPLOADING, "the upload must begin")
        await restarted(at)
        await at.until_state(RunState.FAILED)
        assert at.vehicle.sent == []


async def vanish(at: Desk) -> None:
    """The link is away, and that was noticed."""
    at.vehicle.put(connected=False)
    before = at.vehicle.looks
    await at.until(lambda: at.vehicle.looks > before + 3, "the silence must be looked at")


@pytest.mark.parametrize("ours", [False, True])
async def test_a_flight_that_went_on_to_its_end_unseen_is_completed_and_its_parcel_kept(ours: bool) -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await at.until(lambda: at.run.item_id == "corner", "progress must show")

        def fly_on() -> None:
            at.vehicle.touch_down(complete=True, last_seq=len(at.mission.items) - 1)

        if ours:
            await restarted(at, meanwhile=fly_on)
        else:
            await vanish(at)
            fly_on()
            at.vehicle.put(connected=True)
        await at.until(lambda: at.run.is_over, "the run must end")
        assert at.run.state is RunState.COMPLETED, at.run.reason
        assert (at.drop.outcome, at.vehicle.releases) == (DropOutcome.KEPT, [])


@pytest.mark.parametrize("changes", [{"mission_seq": 2}, {"mission_id": 5}, {"mission_id": None}])
async def test_a_flight_that_ended_unseen_before_its_last_item_or_with_another_mission_is_no_completed_one(
    changes: dict[str, object],
) -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await at.until(lambda: at.run.item_id == "corner", "progress must show")
        await vanish(at)
        at.vehicle.touch_down(complete=True, last_seq=len(at.mission.items) - 1)
        at.vehicle.put(connected=True, **changes)
        await at.until(lambda: at.run.is_over, "the run must end")
        assert at.run.state is RunState.FAILED


async def taken_up(at: Desk) -> None:
    """The new process follows the vehicle: its fleet listens, and its run."""
    await at.until(lambda: len(at.vehicle.listeners) > 1, "the run must be taken up")


async def test_an_item_that_px4_reports_again_after_a_restart_is_not_flown_twice() -> None:
    """MISSION_ITEM_REACHED is repeated for ten seconds, and may come before the first MISSION_CURRENT."""
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await at.until(lambda: at.run.flown_item_ids == ("takeoff",), "the takeoff must count as flown")
        await restarted(at, meanwhile=lambda: at.vehicle.put(mission_seq=None))
        await taken_up(at)
        at.vehicle.put(ItemReached(0))
        at.vehicle.put(mission_seq=2)
        await at.until(lambda: at.run.item_id == "clinic", "progress must show")
        assert at.run.flown_item_ids == ("takeoff", "corner")


async def test_what_was_flown_during_a_restart_shows_at_once() -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await at.until(lambda: at.run.flown_item_ids == ("takeoff",), "the takeoff must count as flown")
        await restarted(at, meanwhile=lambda: at.vehicle.put(mission_seq=2))
        await at.until(lambda: at.run.item_id == "clinic", "progress must show")
        assert at.run.flown_item_ids == ("takeoff", "corner")


async def _started(at: Desk) -> bool:
    """Whether the run takes an order to start; not before the service has seen its vehicle."""
    try:
        await at.runs.start(at.run_id)
    except WrongStateError:
        return False
    return True


@pytest.mark.parametrize("is_restarted", [False, True])
async def test_a_mission_that_would_be_another_now_is_not_started_also_after_a_restart(is_restarted: bool) -> None:
    async with desk("multicopter-embedded.json") as at:
        await at.create(start=False)
        await at.until_state(RunState.UPLOADED)
        facts = at.vehicle.facts
        other = replace(facts, parameters={**facts.parameters, "PD_GRIPPER_TO": 7.0})
        if is_restarted:
            await restarted(at, meanwhile=lambda: setattr(at.vehicle, "facts", other))
        else:
            at.vehicle.facts = other
        async with asyncio.timeout(5.0):
            while not await _started(at):
                await asyncio.sleep(0.01)
        await at.until(lambda: "would change the mission" in describe(at.run.reason), "the start must be refused")
        assert "arm" not in at.vehicle.sent
