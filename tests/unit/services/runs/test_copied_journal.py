"""Two gateways with copies of one journal follow the same run: only the one that has the site commands by itself."""

from __future__ import annotations

from app.domain.drop.record import Certainty, DropOutcome
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode
from tests.support.runs_fixture import desk


async def test_a_gateway_whose_journal_another_one_has_commands_nothing_and_claims_nothing() -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.fleet.gate_commands(lambda: False)
        await at.fly_to_drop()
        await at.until(lambda: at.newest.drops[0].attempts > 0, "it must decide on the release")
        at.vehicle.touch_down(complete=True, last_seq=len(at.mission.items) - 1)
        await at.until(lambda: at.run.is_over, "the run must end")
        assert at.vehicle.releases == []
        assert "set_current 3" not in at.vehicle.sent
        assert (at.drop.outcome, at.drop.certainty) == (DropOutcome.UNKNOWN, Certainty.NONE)


async def test_what_a_person_commands_is_sent_all_the_same() -> None:
    async with desk() as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.fleet.gate_commands(lambda: False)
        await at.fly_to_drop()
        await at.runs.return_to_launch(at.run_id)
        assert at.vehicle.sent[-1] == "return"


async def test_a_wing_that_flies_on_in_hold_is_stopped_by_a_pause_all_the_same() -> None:
    async with desk("fixed-wing-pass.json") as at:
        await at.create()
        await at.until_state(RunState.FLYING)
        at.fleet.gate_commands(lambda: False)
        at.vehicle.put(mode=FlightMode.HOLD)
        await at.until_state(RunState.PAUSED)
        await at.runs.pause(at.run_id)
        assert at.vehicle.sent[-1] == "hold"
        assert at.vehicle.orders == [CIRCLE_HERE], "in Hold it flies on to its last commanded point"
