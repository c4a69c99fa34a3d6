"""The return at a plan's end: paused and resumed, taken by others, and broken off by a commanded landing."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction, RunState
from app.domain.vehicle.state import FlightMode, GlobalPosition, LandedState, MissionState, SignalDurations
from tests.support.flown_flights import DROP, MISSION
from tests.support.told_flight import LAST_SEQ, Told

HOME = GlobalPosition(47.397742, 8.545594, 488.0)


def paused_in_final_return() -> Told:
    told = Told()
    told.return_at_end()
    told.command(RunAction.PAUSE)
    told.see(5.0, mode=FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == (RunState.PAUSED, Reason.of(ReasonCode.PAUSED_AS_ASKED))
    return told


@pytest.mark.parametrize("restarted", [False, True])
def test_a_resumed_return_is_the_missions_again(restarted: bool) -> None:
    told = paused_in_final_return()
    if restarted:
        told.restart()
        told.see()
    assert told.flight.is_in_final_return
    told.command(RunAction.RESUME)
    told.see()
    told.see(3.0, mode=FlightMode.RETURN)
    assert (told.run.state, told.run.reason) == (RunState.RETURNING, Reason.of(ReasonCode.MISSION_DONE))
    assert told.run.commanded is None, "the vehicle has obeyed"
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == (RunState.COMPLETED, None)


def test_a_return_that_a_user_commanded_on_the_way_is_not_the_missions() -> None:
    told = Told()
    told.see()
    told.command(RunAction.RETURN)
    told.see(3.0, mode=FlightMode.RETURN)
    told.command(RunAction.PAUSE)
    told.see(3.0, mode=FlightMode.HOLD)
    assert not told.flight.is_in_final_return, "resumed, it flies the mission"


@pytest.mark.parametrize("paused", [False, True])
@pytest.mark.parametrize("restarted", [False, True])
def test_a_landing_commanded_on_the_return_ends_as_one_anywhere_else(paused: bool, restarted: bool) -> None:
    told = paused_in_final_return() if paused else Told()
    if not paused:
        told.return_at_end()
    told.command(RunAction.LAND)
    told.see(3.0, mode=FlightMode.LAND, landed=LandedState.LANDING)
    told.touch_down()
    if restarted:
        told.restart()
        told.see()
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.ABORTED
    assert told.run.reason == Reason.of(ReasonCode.ASKED_BEFORE_DONE, asked="land")


def test_a_landing_commanded_of_a_vehicle_that_stands_at_home_changes_nothing() -> None:
    told = Told()
    told.return_at_end()
    told.touch_down()
    told.command(RunAction.LAND)
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.COMPLETED


def test_hold_by_somebody_else_on_the_return_is_no_mission_that_holds_where_it_ended() -> None:
    told = Told()
    told.return_at_end()
    told.see(4.0, mode=FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == (RunState.PAUSED, Reason.of(ReasonCode.TAKEN_BY_OTHERS, mode="hold"))
    assert RunState.FLYING not in told.states[told.states.index(RunState.RETURNING) :]


def test_hold_for_a_moment_before_the_return_begins_is_nobody_elses() -> None:
    told = Told()
    told.see()
    told.see(1.0, mode=FlightMode.HOLD, mission_seq=len(told.flight.segment.mission.items) - 1)
    told.see(3.0, mode=FlightMode.RETURN)
    assert RunState.PAUSED not in told.states


def test_hold_before_the_return_shows_as_current_is_no_pause() -> None:
    """PX4: "Mission finished, loitering", then MISSION_CURRENT with the return, then Return mode."""
    told = Told()
    last = MISSION.items[LAST_SEQ - 1]
    told.see(mission_seq=LAST_SEQ - 1, latitude_deg=last.x / 1e7, longitude_deg=last.y / 1e7)
    told.see(0.2, mode=FlightMode.HOLD)
    told.see(0.2, mission_seq=LAST_SEQ)
    told.see(3.0, mode=FlightMode.RETURN, mission_state=MissionState.COMPLETE)
    assert RunState.PAUSED not in told.states


@pytest.mark.parametrize(("north_deg", "held_s"), [(0.0, 5.0), (-0.005, 0.2)], ids=["there", "on its way"])
def test_hold_on_the_way_to_the_return_is_a_pause(north_deg: float, held_s: float) -> None:
    told = Told()
    last = MISSION.items[LAST_SEQ - 1]
    place = {"latitude_deg": last.x / 1e7 + north_deg, "longitude_deg": last.y / 1e7}
    told.see(mission_seq=LAST_SEQ - 1, **place)
    told.see(held_s, mode=FlightMode.HOLD)
    assert told.run.state is RunState.PAUSED


def test_a_return_is_nobody_elses_until_the_vehicle_obeys_the_landing_commanded_on_it() -> None:
    told = Told()
    told.see()
    told.command(RunAction.RETURN)
    told.see(3.0, mode=FlightMode.RETURN)
    told.command(RunAction.LAND)
    told.see(3.0)
    assert (told.run.state, told.run.reason) == (RunState.RETURNING, None)
    told.see(3.0, mode=FlightMode.LAND)
    told.see(3.0, mode=FlightMode.RETURN)
    assert told.run.reason == Reason.of(ReasonCode.RETURN_BY_OTHERS), "the landing was obeyed before"


FAR_AWAY = {"latitude_deg": 47.4, "home": HOME}
"""250 m from home."""
BY_OTHERS = (
    (FlightMode.LAND, False, Reason.of(ReasonCode.LAND_BY_OTHERS)),
    (FlightMode.LAND, True, Reason.of(ReasonCode.FAILSAFE_MODE, mode="land")),
    (FlightMode.POSITION, False, Reason.of(ReasonCode.TAKEN_BY_OTHERS, mode="position")),
    (FlightMode.DESCEND, True, Reason.of(ReasonCode.FAILSAFE_MODE, mode="descend")),
)


@pytest.mark.parametrize("restarted", [False, True])
@pytest.mark.parametrize(("mode", "in_failsafe", "why"), BY_OTHERS)
def test_a_return_that_a_failsafe_or_a_pilot_broke_off_is_not_completed(
    mode: FlightMode, in_failsafe: bool, why: Reason, restarted: bool
) -> None:
    told = Told()
    told.return_at_end()
    told.see(4.0, mode=mode, in_failsafe=in_failsafe, landed=LandedState.LANDING, **FAR_AWAY)
    told.touch_down()
    if restarted:
        told.restart()
        told.see()
    told.see(home=GlobalPosition(47.4, 8.545594, 488.0))  # PX4 moves it there
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED, "somebody must fetch it"
    assert told.run.reason == Reason.of(ReasonCode.LANDED_ELSEWHERE, why)


@pytest.mark.parametrize("command", [RunAction.RETURN, RunAction.CONTINGENCY])
def test_a_return_that_was_commanded_and_broken_off_says_so(command: RunAction) -> None:
    told = Told()
    told.see()
    told.command(command)
    told.see(3.0, mode=FlightMode.RETURN)
    told.see(4.0, mode=FlightMode.LAND, in_failsafe=True, landed=LandedState.LANDING, **FAR_AWAY)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    because = Reason.of(ReasonCode.FAILSAFE_MODE, mode="land")
    assert (told.run.state, told.run.reason) == (RunState.ABORTED, Reason.of(ReasonCode.LANDED_ELSEWHERE, because))


def test_the_end_of_a_mission_that_was_broken_off_names_its_cause() -> None:
    told = Told()
    told.see()
    told.see(4.0, mode=FlightMode.RETURN, in_failsafe=True)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    because = Reason.of(ReasonCode.FAILSAFE)
    assert (told.run.state, told.run.reason) == (RunState.FAILED, Reason.of(ReasonCode.ENDED_EARLY_BECAUSE, because))


def test_a_mission_that_another_station_begins_anew_is_not_in_its_return_any_more() -> None:
    told = Told()
    told.return_at_end()
    told.see(4.0, mode=FlightMode.MISSION, mission_state=MissionState.ACTIVE, mission_seq=1)
    assert not told.flight.is_in_final_return, "resumed, it flies the mission"
    told.see(3.0, mode=FlightMode.RETURN, in_failsafe=True)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED, "it was not flown to its end again"


@pytest.mark.parametrize("mode", [FlightMode.LAND, FlightMode.POSITION])
def test_a_vehicle_that_a_pilot_landed_at_home_has_completed_its_mission(mode: FlightMode) -> None:
    told = Told()
    told.return_at_end()
    told.see(3.0, mode=mode, landed=LandedState.LANDING, home=HOME)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == (RunState.COMPLETED, None)


def test_a_vehicle_that_somebody_disarms_on_its_return_has_not_come_home() -> None:
    """A job queue that went on would arm it again where a person has just switched it off."""
    told = Told()
    told.see(home=HOME)
    told.return_at_end()
    told.see(3.0, **FAR_AWAY)
    moved = GlobalPosition(47.4, 8.545594, 488.0)
    told.see(9.0, mode=FlightMode.HOLD, armed=False, landed=LandedState.ON_GROUND, home=moved)
    assert told.run.state is RunState.FAILED
    assert told.run.reason is not None
    assert told.run.reason.code is ReasonCode.LANDED_ELSEWHERE


@pytest.mark.parametrize("commanded", [None, RunAction.RETURN, RunAction.LAND])
@pytest.mark.parametrize("late_s", [0.1, 1.0])
def test_a_vehicle_that_somebody_disarms_in_the_air_above_home_has_not_landed(
    late_s: float, commanded: RunAction | None
) -> None:
    """PX4 says landed as it is disarmed, and moves home to there. It falls until it lies on the ground."""
    told = Told(has_clock=True)
    told.see(home=HOME, absolute_altitude_m=508.0)
    if commanded is None:
        told.return_at_end()
    else:
        told.command(commanded)
        told.see(3.0, mode=FlightMode.LAND if commanded is RunAction.LAND else FlightMode.RETURN)
    told.see(10.0, absolute_altitude_m=498.0)
    told.see(late_s, absolute_altitude_m=498.0 - 4.9 * late_s**2)
    moved = replace(HOME, altitude_m=495.0)
    falls = {"landed": LandedState.ON_GROUND, "armed": False, "mode": FlightMode.HOLD, "durations": SignalDurations()}
    told.see(1.0, home=moved, **falls)
    told.see(3.0, absolute_altitude_m=488.2, relative_altitude_m=-6.8)
    told.see(3.0, durations=SignalDurations(4.0, 4.0, 3.0))
    assert (told.run.state, told.run.reason) == (RunState.FAILED, Reason.of(ReasonCode.FELL, fallen_m=9.8))


@pytest.mark.parametrize("gone_s", [0.0, 10.0], ids=["seen", "unseen"])
def test_a_descent_to_the_ground_is_no_fall(gone_s: float) -> None:
    """1.5 m/s, and landed is said as it touches the ground. What sank in a loss of the link is not known to have
    fallen.
    """
    told = Told(has_clock=True)
    told.see(home=HOME, absolute_altitude_m=498.0)
    told.return_at_end()
    if gone_s:
        told.see(gone_s, connected=False)
        told.see(connected=True)
    for tenths in range(0 if gone_s else 65):
        told.see(absolute_altitude_m=498.0 - 0.15 * tenths)
    told.state = replace(told.state, absolute_altitude_m=488.2)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == (RunState.COMPLETED, None)


@pytest.mark.parametrize(
    ("north_deg", "state"),
    [(0.00001, RunState.COMPLETED), (0.002, RunState.FAILED)],
    ids=["at home", "elsewhere"],
)
def test_a_return_that_ended_while_waydrop_was_stopped_is_judged_by_home_of_the_takeoff(
    north_deg: float, state: RunState
) -> None:
    told = Told()
    told.see(home=HOME, latitude_deg=47.4)
    told.return_at_end()
    there_deg = HOME.latitude_deg + north_deg
    told.state = replace(told.state, mode=FlightMode.HOLD, armed=False, landed=LandedState.ON_GROUND)
    told.state = replace(told.state, latitude_deg=there_deg, home=replace(HOME, latitude_deg=there_deg))
    told.restart()
    told.see(9.0)
    assert told.run.state is state


def test_a_drop_that_the_vehicle_was_only_on_its_way_to_is_not_flown() -> None:
    told = Told()
    told.see()
    told.see(mission_seq=min(DROP.hold_seqs))
    told.see(3.0, mode=FlightMode.RETURN)
    told.touch_down()
    told.disarm(FlightMode.HOLD)
    assert told.run.is_over
    assert DROP.plan_item_id not in told.run.flown_item_ids
    assert told.flight.segment.mission.plan_item_of[min(DROP.hold_seqs)] not in told.run.flown_item_ids


UNSEEN = Reason.of(ReasonCode.LANDING_UNSEEN)
ELSEWHERE = Reason.of(ReasonCode.LANDED_ELSEWHERE, UNSEEN)
AWAY_DEG = 0.002


@pytest.mark.parametrize("home_first", [False, True])
@pytest.mark.parametrize("mode", [FlightMode.HOLD, FlightMode.LAND], ids=["disarmed", "still armed"])
@pytest.mark.parametrize(
    ("north_deg", "end"),
    [(0.00001, (RunState.COMPLETED, None)), (AWAY_DEG, (RunState.FAILED, ELSEWHERE))],
    ids=["at home", "elsewhere"],
)
def test_a_return_whose_link_is_lost_is_judged_by_where_the_vehicle_stands(
    north_deg: float, end: tuple[RunState, Reason | None], mode: FlightMode, home_first: bool
) -> None:
    """The link is back a moment before EXTENDED_SYS_STATE, and the position comes after it. As the vehicle disarms, PX4
    moves home, and may say so before it says that it has landed.
    """
    told = Told()
    told.see(home=HOME, latitude_deg=47.4)
    told.return_at_end()
    told.see(20.0, connected=False)
    there_deg = HOME.latitude_deg + north_deg
    moved = {"home": replace(HOME, latitude_deg=there_deg)}
    told.see(0.5, connected=True, position_age_s=21.0, mode=mode, **(moved if home_first else {}))
    told.see(0.5, landed=LandedState.ON_GROUND)
    told.see(1.0, position_age_s=0.1, latitude_deg=there_deg, **moved)
    told.disarm(FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == end


@pytest.mark.parametrize("seen_in_air", [True, False])
def test_a_mission_that_ended_unseen_before_its_end_says_that_nobody_saw_it(seen_in_air: bool) -> None:
    told = Told()
    told.see(home=HOME, landed=LandedState.IN_AIR if seen_in_air else LandedState.ON_GROUND)
    told.see(20.0, connected=False)
    told.see(0.5, connected=True, mode=FlightMode.HOLD, landed=LandedState.ON_GROUND)
    told.disarm(FlightMode.HOLD)
    assert told.run.state is RunState.FAILED
    if seen_in_air:
        assert told.run.reason == Reason.of(ReasonCode.ENDED_EARLY_BECAUSE, UNSEEN)


@pytest.mark.parametrize("late_s", [1.0, 4.0])
def test_a_flight_that_nobody_saw_at_all_is_judged_by_its_place(late_s: float) -> None:
    told = Told()
    told.see(home=HOME, landed=LandedState.ON_GROUND)
    told.see(60.0, connected=False)
    away = {"latitude_deg": HOME.latitude_deg + AWAY_DEG, "home": replace(HOME, latitude_deg=47.5)}
    done = {"mission_seq": LAST_SEQ, "mission_state": MissionState.COMPLETE}
    told.see(late_s, connected=True, mode=FlightMode.HOLD, **done, **away)
    told.disarm(FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == (RunState.FAILED, ELSEWHERE)


@pytest.mark.parametrize("seen", [True, False])
@pytest.mark.parametrize(
    ("north_deg", "end"),
    [(0.0, (RunState.COMPLETED, None)), (AWAY_DEG, (RunState.FAILED, ELSEWHERE))],
    ids=["at home", "elsewhere"],
)
def test_a_landing_on_the_way_is_not_taken_for_the_last_one_after_a_loss_of_the_link(
    north_deg: float, end: tuple[RunState, Reason | None], seen: bool
) -> None:
    told = Told()
    yard = {"latitude_deg": HOME.latitude_deg + 0.001, "landed": LandedState.ON_GROUND}
    told.see(home=HOME)
    if not seen:
        told.see(6.0, connected=False)
    told.see(5.0, connected=True, **yard)
    told.see(90.0, connected=False)
    told.see(0.5, connected=True, mission_seq=LAST_SEQ, mission_state=MissionState.COMPLETE, position_age_s=90.0)
    told.see(1.0, latitude_deg=HOME.latitude_deg + north_deg, position_age_s=0.1)
    told.disarm(FlightMode.HOLD)
    assert (told.run.state, told.run.reason) == end


def test_the_cause_of_a_landing_that_began_in_sight_is_told_though_its_end_was_not_seen() -> None:
    told = Told()
    told.see(home=HOME, latitude_deg=HOME.latitude_deg + AWAY_DEG)
    told.see(10.0, mode=FlightMode.LAND, landed=LandedState.LANDING, in_failsafe=True)
    because = told.run.reason
    assert because == Reason.of(ReasonCode.FAILSAFE_MODE, mode="land")
    told.see(5.0, connected=False)
    told.see(1.0, connected=True, landed=LandedState.ON_GROUND)
    told.disarm(FlightMode.HOLD)
    assert told.run.reason == Reason.of(ReasonCode.LANDED_ELSEWHERE, because)
