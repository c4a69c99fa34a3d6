"""Two gateways with copies of one journal follow the same run: only the one that has the site commands by itself."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.cluster.lease import SiteUndecidedError
from app.domain.drop.record import Certainty, DropOutcome
from app.domain.errors import RunNotFollowedError
from app.domain.mission import MissionItem, MissionType
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.run_service import run_service


@pytest.mark.parametrize("why", ["site", "run"])
async def test_a_gateway_whose_journal_or_run_another_one_has_commands_nothing_and_claims_nothing(why: str) -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        if why == "site":
            service.fleet.gate_commands(lambda: False)
        else:
            service.fleet.gate_runs({service.run_id}.__contains__)
        await service.fly_to_drop()
        await service.until(lambda: service.newest.drops[0].attempts > 0, "it must decide on the release")
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        await service.until(lambda: service.run.is_over, "the run must end")
        assert service.vehicle.releases == []
        assert "set_current 3" not in service.vehicle.sent
        assert (service.drop.outcome, service.drop.certainty) == (DropOutcome.UNKNOWN, Certainty.NONE)


async def test_what_a_person_commands_is_sent_all_the_same() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.fleet.gate_commands(lambda: False)
        await service.fly_to_drop()
        await service.runs.return_to_launch(service.run_id)
        assert service.vehicle.sent[-1] == "return"


async def test_a_wing_that_flies_on_in_hold_is_stopped_by_a_pause_all_the_same() -> None:
    async with run_service("fixed-wing-pass.json") as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.fleet.gate_commands(lambda: False)
        service.vehicle.put(mode=FlightMode.HOLD)
        await service.until_state(RunState.PAUSED)
        await service.runs.pause(service.run_id)
        assert service.vehicle.sent[-1] == "hold"
        assert service.vehicle.orders == [CIRCLE_HERE], "in Hold it flies on to its last commanded point"


async def test_no_run_is_followed_anew_while_runs_of_another_gateway_are_taken_over() -> None:
    async with run_service() as service:
        service.fleet.gate_new_work(lambda: SiteUndecidedError("runs of another gateway are being taken over"))
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(service.fleet.until_may_follow("run-1", 0.01), 0.2)
        service.fleet.gate_new_work(lambda: None)
        await asyncio.wait_for(service.fleet.until_may_follow("run-1", 0.01), 10.0)


async def test_a_run_is_not_followed_anew_until_it_is_known_how_another_gateway_ended_it() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        left = {service.run_id}
        service.fleet.gate_runs(left.__contains__)
        await service.runs.take_over(service.run, by="gw-1", of="gw-2")
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(service.fleet.until_may_follow(service.run_id, 0.01), 0.5)
        assert service.run.state is RunState.FLYING, "whether its parcel is on board is not known here"
        with pytest.raises(RunNotFollowedError, match="another gateway followed it"):
            await service.runs.pause(service.run_id)
        left.clear()
        await service.until(lambda: service.run.is_over, "nobody else knows more of it")


@pytest.mark.parametrize(("known", "doubts"), [(None, 0), (1, 1)], ids=["nothing was heard", "it was before the drop"])
async def test_a_taken_over_run_waits_until_its_vehicle_names_its_item(
    monkeypatch: pytest.MonkeyPatch, known: int | None, doubts: int
) -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        hold = min(service.mission.drops[0].hold_seqs)
        download, is_read = service.vehicle.download, asyncio.Event()

        async def read(mission_type: MissionType) -> tuple[MissionItem, ...]:
            is_read.set()
            return await download(mission_type)

        monkeypatch.setattr(service.vehicle, "download", read)
        service.vehicle.mission_age_s = 20.0
        service.vehicle.put(landed=LandedState.IN_AIR, mission_seq=known)  # what was heard before the link was lost
        await service.runs.take_over(service.run, by="gw-1", of="gw-2")
        await is_read.wait()
        service.vehicle.mission_age_s = 0.0
        service.vehicle.put(mission_seq=hold - 1 if known is None else hold)
        await service.until(lambda: not service.run.is_new_here, "its vehicle is found")
        assert [drop.attempts for drop in service.run.drops] == [doubts]
