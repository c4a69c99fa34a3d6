"""A drop that fails with its parcel on board is made again at its alternate, and only then."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.domain.drop.consent import Answer
from app.domain.drop.record import DropOutcome, DropPhase
from app.domain.errors import DropInProgressError, LinkTimeoutError
from app.domain.events import NewEvent
from app.domain.flight.segment import concluded_drops
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.targets import TargetReport
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode
from tests.support.events import data_of
from tests.support.fakes import ManualClock
from tests.support.plan_pieces import at
from tests.support.run_service import RunService, restarted, run_service

ALTERNATE = at(0, 120, relative_altitude_m=20, id="locker", hold_s=20)


def _asks(document: dict[str, Any]) -> None:
    drop = next(item for item in document["items"] if item["type"] == "gripper")
    drop.update(alternate=ALTERNATE, consent="operator", hold_s=60)
    document["contingency"]["on_drop_failure"] = "return"


def _plain(document: dict[str, Any]) -> None:
    _asks(document)
    next(item for item in document["items"] if item["type"] == "gripper")["consent"] = "none"


@pytest.fixture
async def asking() -> AsyncIterator[RunService]:
    """A run that asks for consent at its drop, in flight."""
    async with run_service(changes=_asks) as made:
        await made.create()
        await made.fly_to_drop()
        await made.until(lambda: made.drop.phase is DropPhase.ASKING, "an operator must be asked")
        yield made


@pytest.fixture
async def plain() -> AsyncIterator[RunService]:
    """A run with an alternate and without consent, created."""
    async with run_service(changes=_plain) as made:
        await made.create()
        yield made


async def _refuse(made: RunService) -> None:
    await made.runs.answer_consent(made.run_id, made.drop.plan_item_id, Answer(grant=False, question=1), "pilot")


def _outcomes(made: RunService) -> list[tuple[str, str]]:
    return [(drop.plan_item_id, drop.outcome.value) for drop in made.run.drops]


def _sent_to(made: RunService) -> list[str]:
    return [sent for sent in made.vehicle.sent if sent.startswith("set_current") and sent != "set_current 0"]


async def _fly_on_to_the_alternate(made: RunService) -> None:
    there = made.mission.drops[0].alternate
    assert there is not None
    await made.until(lambda: f"set_current {there.hold_seqs[0]}" in made.vehicle.sent, "it must be sent on")
    await made.vehicle.fly_to_hold(there.latitude_deg, there.longitude_deg, there.hold_seqs[0])


async def test_a_refused_drop_is_made_at_its_alternate_with_a_record_of_its_own(asking: RunService) -> None:
    await _refuse(asking)
    await _fly_on_to_the_alternate(asking)
    await asking.until(lambda: len(asking.run.drops) == 2 and asking.run.drops[1].phase is DropPhase.DONE, "a 2nd drop")
    first, second = asking.run.drops
    assert (first.outcome, second.outcome) == (DropOutcome.KEPT, DropOutcome.RELEASED)
    assert (second.plan_item_id, second.alternate_to) == ("locker", first.plan_item_id)
    assert (first.attempts, second.attempts, len(asking.vehicle.releases)) == (0, 1, 1)
    assert second.latitude_deg == pytest.approx(ALTERNATE["latitude_deg"])
    assert "return" not in asking.vehicle.sent, "what the plan says of a failure is for the alternate"
    await asking.until(
        lambda: _sent_to(asking)[-1] == f"set_current {asking.mission.drops[0].resume_seq}", "it goes on"
    )
    assert asking.run.flown_item_ids[-2:] == (first.plan_item_id, "locker")


async def test_a_release_that_was_refused_is_tried_at_the_alternate(plain: RunService) -> None:
    plain.vehicle.answers = [[MavResult.DENIED]]
    await plain.fly_to_drop()
    await _fly_on_to_the_alternate(plain)
    await plain.until(lambda: _outcomes(plain)[-1] == ("locker", "released"), "it must be released there")
    assert _outcomes(plain)[0][1] == "kept"


async def test_a_parcel_that_may_be_gone_is_never_flown_on(plain: RunService) -> None:
    plain.vehicle.answers = [LinkTimeoutError("no answer")] * 3
    await plain.fly_to_drop()
    await plain.until(lambda: plain.drop.outcome is DropOutcome.UNKNOWN, "nobody knows what became of it")
    await plain.until(lambda: "return" in plain.vehicle.sent, "the plan says return")
    assert len(plain.run.drops) == 1
    assert _sent_to(plain) == []


async def test_a_released_parcel_needs_no_alternate(plain: RunService) -> None:
    await plain.fly_to_drop()
    await plain.until(lambda: plain.drop.outcome is DropOutcome.RELEASED, "it must be released")
    await plain.until(lambda: _sent_to(plain) == [f"set_current {plain.mission.drops[0].resume_seq}"], "it goes on")
    assert len(plain.run.drops) == 1
    plain.vehicle.put(mission_seq=plain.mission.drops[0].resume_seq)
    await plain.until(lambda: plain.run.item_id != plain.mission.drops[0].plan_item_id, "it flies on")
    assert "locker" not in plain.run.flown_item_ids


async def test_a_vehicle_that_somebody_took_is_not_sent_to_the_alternate(asking: RunService) -> None:
    asking.vehicle.put(mode=FlightMode.POSITION)
    await asking.until_state(RunState.PAUSED)
    asking.vehicle.put(mode=FlightMode.RETURN)
    asking.vehicle.touch_down(complete=False, last_seq=0)
    await asking.until(lambda: asking.run.is_over, "the run must end")
    assert _outcomes(asking) == [(asking.drop.plan_item_id, "kept")]
    assert _sent_to(asking) == []


async def test_if_the_alternate_fails_too_the_plan_says_what_then(asking: RunService) -> None:
    await _refuse(asking)
    await asking.until(lambda: len(asking.run.drops) == 2 and bool(_sent_to(asking)), "it must be sent on")
    asking.vehicle.put(mission_seq=asking.mission.drops[0].resume_seq)  # it passes the alternate without a hold
    await asking.until(lambda: "return" in asking.vehicle.sent, "the plan says return")
    assert [outcome for _, outcome in _outcomes(asking)] == ["kept", "kept"]


async def test_the_plan_is_not_changed_on_the_way_to_the_alternate_and_its_drop_never_made_again(
    asking: RunService,
) -> None:
    await _refuse(asking)
    await asking.until(lambda: len(asking.run.drops) == 2 and bool(_sent_to(asking)), "it must be sent on")
    asking.vehicle.put(relative_altitude_m=15.0)
    with pytest.raises(DropInProgressError):
        await asking.runs.change_mission(asking.run_id, "plan-1", None, "ann")
    await _fly_on_to_the_alternate(asking)
    await asking.until(lambda: _outcomes(asking)[1] == ("locker", "released"), "it must be released there")
    assert concluded_drops(asking.run.drops) == {asking.drop.plan_item_id, "locker"}


async def test_an_order_that_could_come_too_late_is_not_sent(plain: RunService) -> None:
    def store_slowly(event: NewEvent) -> None:
        if any(drop["plan_item_id"] == "locker" for drop in data_of(event).get("drops", ())):
            plain.vehicle.boot_ahead_s = 62.5  # the hold ends within 2.5 s, and the command is tried for 3.5 s

    plain.vehicle.answers = [[MavResult.DENIED]]
    plain.events.refuse = store_slowly
    await plain.fly_to_drop()
    await plain.until(lambda: len(plain.run.drops) == 2, "what is about to be sent must be stored")
    looks = plain.vehicle.looks
    await plain.until(lambda: plain.vehicle.looks > looks + 4, "it must be looked at")
    assert _sent_to(plain) == []
    plain.vehicle.put(mission_seq=plain.mission.drops[0].resume_seq)
    await plain.until(lambda: "return" in plain.vehicle.sent, "the alternate is passed, and the plan says return")
    assert [outcome for _, outcome in _outcomes(plain)] == ["kept", "kept"]
    assert _sent_to(plain) == []


def _at_a_ship(document: dict[str, Any]) -> None:
    _plain(document)
    drop = next(item for item in document["items"] if item["type"] == "gripper")
    drop["target"] = {"feed": "ship-1", "max_move_m": 40, "max_speed_m_s": 2}


async def test_a_drop_refused_at_its_moving_target_is_made_at_its_fixed_alternate_without_the_target() -> None:
    clock = ManualClock()
    async with run_service(changes=_at_a_ship, target_clock=clock) as made:
        ship = {
            "latitude_deg": made.mission.drops[0].latitude_deg,
            "longitude_deg": made.mission.drops[0].longitude_deg,
        }
        made.targets.report("ship-1", TargetReport(**ship, north_m_s=0.0, east_m_s=0.0, time=clock.now()))
        await made.create()
        made.vehicle.answers = [[MavResult.DENIED]]
        await made.fly_to_drop()
        await made.until(lambda: len(made.run.drops) == 2, "it must be sent on")
        clock.time_s += 60.0  # the ship is not heard any more
        await _fly_on_to_the_alternate(made)
        await made.until(lambda: _outcomes(made)[-1] == ("locker", "released"), "it must be released there")
        first, second = made.run.drops
        assert first.target is not None
        assert first.target.distance_m == pytest.approx(0.0, abs=0.1)
        assert (first.outcome, second.target) == (DropOutcome.KEPT, None)


@pytest.fixture
async def unheard() -> AsyncIterator[RunService]:
    """A run that was sent to its alternate and is not heard on the way there."""
    async with run_service(changes=_plain) as made:
        await made.create()
        made.vehicle.answers = [[MavResult.DENIED]]
        await made.fly_to_drop()
        await made.until(lambda: len(made.run.drops) == 2 and bool(_sent_to(made)), "it must be sent on")
        made.vehicle.put(latitude_deg=47.0)
        await made.until(lambda: made.run.item_id == "locker", "it flies there")
        made.vehicle.put(connected=False)
        looks = made.vehicle.looks
        await made.until(lambda: made.vehicle.looks > looks + 2, "it must be seen that the link is lost")
        yield made


async def test_a_link_lost_on_the_way_to_the_alternate_drops_nothing_and_nothing_turns_back(
    unheard: RunService,
) -> None:
    unheard.vehicle.put(connected=True, mission_seq=unheard.mission.drops[0].resume_seq)
    await unheard.until(lambda: "return" in unheard.vehicle.sent, "it passed the alternate, and the plan says return")
    assert [outcome for _, outcome in _outcomes(unheard)] == ["kept", "kept"]
    assert (len(unheard.vehicle.releases), len(_sent_to(unheard))) == (1, 1), "only those of before"
    assert unheard.run.flown_item_ids[-1] == "locker", "it was on its way there when it was last seen"


async def test_a_vehicle_heard_again_after_its_mission_tells_why_the_parcel_was_kept(unheard: RunService) -> None:
    unheard.vehicle.put(connected=True, mode=FlightMode.RETURN)
    unheard.vehicle.touch_down(complete=True, last_seq=len(unheard.mission.items) - 1)
    await unheard.until(lambda: unheard.run.is_over, "the run must end")
    assert (unheard.run.state, _outcomes(unheard)[1]) == (RunState.COMPLETED, ("locker", "kept"))
    assert unheard.run.drops[1].reason == Reason.of(ReasonCode.FLOWN_TO_END)


async def test_a_failsafe_on_the_way_to_the_alternate_keeps_the_parcel_and_the_vehicle(unheard: RunService) -> None:
    sent = list(unheard.vehicle.sent)
    unheard.vehicle.put(connected=True, mode=FlightMode.RETURN)
    await unheard.until_state(RunState.RETURNING)
    unheard.vehicle.touch_down(complete=False, last_seq=0)
    await unheard.until(lambda: unheard.run.is_over, "the run must end")
    assert [outcome for _, outcome in _outcomes(unheard)] == ["kept", "kept"]
    assert unheard.vehicle.sent == sent


async def test_a_vehicle_heard_again_while_it_waits_at_the_alternate_drops_there(unheard: RunService) -> None:
    there = unheard.mission.drops[0].alternate
    assert there is not None
    place = {"latitude_deg": there.latitude_deg, "longitude_deg": there.longitude_deg}
    unheard.vehicle.put(connected=True, relative_altitude_m=there.relative_altitude_m, **place)
    await unheard.until(lambda: _outcomes(unheard)[1] == ("locker", "released"), "it must be released there")


async def test_after_a_restart_the_drop_at_the_alternate_goes_on(asking: RunService) -> None:
    await _refuse(asking)
    await asking.until(lambda: len(asking.run.drops) == 2 and bool(_sent_to(asking)), "it must be sent on")
    asking.vehicle.put(latitude_deg=47.0)
    await asking.until(lambda: asking.run.item_id == "locker", "it flies there")
    await restarted(asking)
    there = asking.mission.drops[0].alternate
    assert there is not None
    await asking.vehicle.fly_to_hold(there.latitude_deg, there.longitude_deg, there.hold_seqs[0])
    await asking.until(lambda: asking.run.drops[1].phase is DropPhase.DONE, "it must end")
    assert _outcomes(asking)[1] == ("locker", "released")
