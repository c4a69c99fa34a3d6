"""Another client uploads a mission in flight: nothing of it is taken for the run's."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.flight.inputs import FactReceived, ReleaseAcknowledged
from app.domain.flight.snapshot import ContingencyCommand, ReleaseCommand, ResumeCommand
from app.domain.mission import MavCmd
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.commands import CommandAck, MavResult
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode, LandedState, MissionState, VehicleState
from tests.support.flown_flights import DROP, MISSION_ID, Flown
from tests.support.told_flight import LAST_SEQ, Told

OTHER_ID = MISSION_ID + 1
OTHER_ON_BOARD = Reason.of(ReasonCode.OTHER_MISSION_ON_BOARD)


@dataclass
class Replaced(Flown):
    """From `from_s` on the vehicle flies another mission, with its items at the same places."""

    from_s: float = field(default=float("inf"))

    @property
    def state(self) -> VehicleState:
        return replace(super().state, mission_id=OTHER_ID if self.now_s >= self.from_s else MISSION_ID)


def at_drop(flown: Flown) -> Flown:
    while flown.run.state is not RunState.AT_DROP:
        flown.tick()
    return flown


def test_nothing_is_released_at_the_same_place_of_another_mission() -> None:
    flown = Replaced()
    flown.from_s = flown.now_s + 1.0
    run = flown.to_the_end()
    assert flown.commands == [], "neither a release nor a set_current into the other mission"
    assert run.state is RunState.FAILED
    assert run.drop(DROP.plan_item_id).outcome is DropOutcome.KEPT


@pytest.mark.parametrize("result", [MavResult.ACCEPTED, MavResult.DENIED])
def test_an_answer_after_the_replacement_moves_no_item_and_commands_nothing(result: MavResult) -> None:
    flown = at_drop(Replaced())
    while not flown.commands:
        flown.tick()
    assert flown.commands == [ReleaseCommand(DROP.plan_item_id, 1)]
    flown.attempt, flown.from_s = 0, flown.now_s
    flown.tick()
    ack = CommandAck(MavCmd.DO_GRIPPER, result)
    flown.feed(ReleaseAcknowledged(flown.observed, 0, DROP.plan_item_id, 1, ack))
    for _ in range(50):
        flown.tick()
    assert not [one for one in flown.commands if isinstance(one, (ResumeCommand, ContingencyCommand))]
    expected = DropOutcome.RELEASED if result is MavResult.ACCEPTED else DropOutcome.KEPT
    assert flown.run.drop(DROP.plan_item_id).outcome in (expected, DropOutcome.RELEASED)


def test_the_items_of_another_mission_are_not_flown_and_the_run_is_paused() -> None:
    told = Told()
    told.see(1.0)
    flown = told.run.flown_item_ids
    told.see(5.0, mission_id=OTHER_ID)
    assert (told.run.state, told.run.reason) == (RunState.PAUSED, OTHER_ON_BOARD)
    told.feed(FactReceived(told.observed, ItemReached(LAST_SEQ)))
    told.see(5.0, mission_seq=LAST_SEQ, mission_state=MissionState.COMPLETE)
    assert told.run.flown_item_ids == flown
    assert not told.flight.mission_done


def test_a_run_whose_vehicle_flew_another_mission_is_never_completed() -> None:
    told = Told()
    told.see(1.0)
    told.see(5.0, mission_id=OTHER_ID)
    told.return_at_end()
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED


def test_another_mission_that_lands_ends_the_run_with_that_reason() -> None:
    told = Told()
    told.see(1.0)
    told.see(5.0, mission_id=OTHER_ID)
    told.see(1.0, landed=LandedState.ON_GROUND, mission_state=MissionState.COMPLETE)
    told.see(6.0, armed=False)
    assert (told.run.state, told.run.reason) == (
        RunState.FAILED,
        Reason.of(ReasonCode.ENDED_EARLY_BECAUSE, OTHER_ON_BOARD),
    )


def test_a_return_of_a_user_is_still_a_return() -> None:
    told = Told()
    told.see(5.0, mission_id=OTHER_ID)
    told.command(RunAction.RETURN)
    told.see(3.0, mode=FlightMode.RETURN)
    assert (told.run.state, told.run.reason) == (RunState.RETURNING, Reason.of(ReasonCode.RETURNING_AS_ASKED))


def test_a_vehicle_that_holds_with_another_mission_says_so() -> None:
    told = Told()
    told.see(5.0, mission_id=OTHER_ID)
    told.see(5.0, mode=FlightMode.HOLD)
    assert told.run.reason == OTHER_ON_BOARD


def test_the_runs_own_mission_is_followed_again_once_it_is_back() -> None:
    told = Told()
    told.see(5.0, mission_id=OTHER_ID)
    told.see(1.0, mission_id=MISSION_ID, mission_seq=2)
    assert (told.run.state, told.flight.progress.current) == (RunState.FLYING, 2)


@pytest.mark.parametrize("named", [None, MISSION_ID])
def test_a_firmware_that_names_no_mission_is_followed_as_before(named: int | None) -> None:
    told = Told()
    told.see(5.0, mission_id=named, mission_seq=2)
    assert (told.run.state, told.flight.progress.current) == (RunState.FLYING, 2)


def test_an_id_that_is_late_pauses_nothing() -> None:
    told = Told()
    told.see(1.0)
    told.see(2.0, mission_id=OTHER_ID, mission_seq=2)
    assert told.run.state is RunState.FLYING
    assert told.flight.progress.current == 1, "but nothing counts meanwhile"
