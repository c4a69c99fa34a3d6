"""The winch as an external payload: a component of its own that acknowledges by itself, action by action."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import Message, mavlink
from app.simulator.external.winch import FULL_LENGTH_M, Action, Flag, Winch
from app.simulator.wire import Cmd, Result
from tests.support.simulated_vehicle import GROUND, RETURN, GroundStation, do, takeoff, waypoint

NAN = math.nan
OTHER = (246, 191)
ALL_RESULTS = [Result.IN_PROGRESS, Result.ACCEPTED]
SEQUENCES = (Action.DELIVER, Action.RETRACT, Action.LOAD_LINE, Action.ABANDON_LINE, Action.LOAD_PAYLOAD)


@pytest.fixture
def gcs() -> GroundStation:
    return GroundStation(winch=True)


def device(gcs: GroundStation) -> Winch:
    assert gcs.vehicle.winch is not None
    return gcs.vehicle.winch


def ask(
    gcs: GroundStation,
    action: float,
    length_m: float = NAN,
    rate_m_s: float = NAN,
    *,
    wait_s: float = 60.0,
    source: tuple[int, int] = GROUND,
    target: tuple[int, int] = (1, 169),
) -> list[int]:
    """DO_WINCH; what the winch answers to `source`. Parameters that the action does not use are NaN."""
    mark = len(gcs.received)
    params = (1, action, length_m, rate_m_s, 0, 0, 0)
    gcs.send(mavlink.MAVLink_command_long_message(*target, Cmd.DO_WINCH, 0, *params), source)
    gcs.fly(wait_s)
    return [ack.result for ack in answers(gcs, mark) if ack.target_system == source[0]]


def answers(gcs: GroundStation, mark: int = 0) -> list[Message]:
    return [h.message for h in gcs.received[mark:] if h.name == "COMMAND_ACK" and h.component == 169]


def flags(gcs: GroundStation) -> Flag:
    return Flag(gcs.last("WINCH_STATUS").status)


def seen_flags(gcs: GroundStation) -> Flag:
    """All that were shown at one time or another."""
    found = Flag(0)
    for status in gcs.messages("WINCH_STATUS"):
        found |= Flag(status.status)
    return found


# who answers whom -------------------------------------------------------------------------------------------


def test_it_is_a_component_of_its_own_with_heartbeat_and_status(gcs: GroundStation) -> None:
    heartbeats = [h.message for h in gcs.received if h.name == "HEARTBEAT" and h.component == 169]
    assert {(beat.type, beat.autopilot) for beat in heartbeats} == {(42, 8)}
    assert len(heartbeats) == len(gcs.messages("WINCH_STATUS")) == pytest.approx(6, abs=1)
    assert flags(gcs) == Flag.HEALTHY | Flag.FULLY_RETRACTED | Flag.LOCKED


def test_each_ack_goes_from_the_winch_to_the_one_who_asked(gcs: GroundStation) -> None:
    assert ask(gcs, Action.RELATIVE_LENGTH, 4.0, 1.0, wait_s=1.0) == [Result.IN_PROGRESS]
    assert ask(gcs, Action.RETRACT, source=OTHER) == ALL_RESULTS
    to_each = [(ack.target_system, ack.target_component, ack.result, ack.progress) for ack in answers(gcs)]
    in_progress, cancelled, accepted = Result.IN_PROGRESS, Result.CANCELLED, Result.ACCEPTED
    assert to_each == [
        (*GROUND, in_progress, 255), (*GROUND, cancelled, 0), (*OTHER, in_progress, 255), (*OTHER, accepted, 0),
    ]  # fmt: skip


@pytest.mark.parametrize(("target", "received"), [((1, 169), 1), ((1, 0), 1), ((0, 0), 1), ((1, 1), 0), ((9, 169), 0)])
def test_it_hears_what_is_for_it_or_for_all(gcs: GroundStation, target: tuple[int, int], received: int) -> None:
    assert len(ask(gcs, Action.HOLD, wait_s=0.1, target=target)) == received


def test_no_autopilot_executes_or_even_answers_it() -> None:
    """PX4's commander leaves DO_WINCH to others; without a winch nobody answers."""
    gcs = GroundStation()
    assert gcs.command(Cmd.DO_WINCH, 1, Action.DELIVER, wait_s=5.0) == []


def test_a_mission_reaches_it_and_its_ack_reaches_no_ground_station() -> None:
    gcs = GroundStation(winch=True, params={"MIS_COMMAND_TOUT": 20.0})
    gcs.start([takeoff(10), waypoint(15, 0, 10, 2, 1), do(Cmd.DO_WINCH, 1, Action.DELIVER), RETURN])
    gcs.until(lambda: device(gcs).delivered)
    assert gcs.distance_to(15, 0) < 1.5
    assert gcs.vehicle.store.current_seq == 2, "the mission waits while the line is out"
    gcs.until(lambda: gcs.vehicle.store.current_seq == 3)
    own = [m for m in gcs.messages("COMMAND_LONG") if m.command == Cmd.DO_WINCH]
    assert [(m.target_system, m.target_component, m.confirmation) for m in own] == [(1, 0, n) for n in range(4)]
    assert answers(gcs) == []


def test_its_state_outlives_a_reboot_of_the_autopilot(gcs: GroundStation) -> None:
    ask(gcs, Action.RELATIVE_LENGTH, 4.0)
    gcs.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 1)
    gcs.fly(3.0)
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(4.0)


# the actions ------------------------------------------------------------------------------------------------


def test_deliver_drops_slows_down_touches_down_reels_up_and_locks() -> None:
    gcs = GroundStation(winch=True)
    gcs.start([takeoff(12), waypoint(5, 0, 12, 60, 1)])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 11.5)
    begin_s = gcs.now_s
    assert ask(gcs, Action.DELIVER, length_m=3.0, wait_s=16.0) == ALL_RESULTS
    lengths = [status.line_length for status in gcs.messages("WINCH_STATUS", begin_s)]
    assert max(lengths) == pytest.approx(12.0, abs=0.6), "down to the ground: the length is no parameter of it"
    phases = Flag.DROPPING | Flag.ARRESTING | Flag.GROUND_SENSE | Flag.RETRACTING | Flag.MOVING
    assert seen_flags(gcs) & phases == phases
    assert flags(gcs) == Flag.HEALTHY | Flag.FULLY_RETRACTED | Flag.LOCKED
    assert device(gcs).delivered


def test_deliver_fails_at_once_where_the_line_does_not_reach_the_ground(gcs: GroundStation) -> None:
    gcs.vehicle.state.body.up_m = FULL_LENGTH_M + 5.0
    assert ask(gcs, Action.DELIVER, wait_s=0.1) == [Result.FAILED]
    assert not device(gcs).delivered


@pytest.mark.parametrize(("length_m", "rate_m_s", "takes_s"), [(4.0, 2.0, 2.0), (4.0, -2.0, 2.0), (4.0, NAN, 4.0)])
def test_length_lets_out_so_much_at_a_rate_if_one_is_given(
    gcs: GroundStation, length_m: float, rate_m_s: float, takes_s: float
) -> None:
    begin_s = gcs.now_s
    assert ask(gcs, Action.RELATIVE_LENGTH, length_m, rate_m_s, wait_s=takes_s + 1.1) == ALL_RESULTS
    end_s = [h.t_s for h in gcs.received if h.name == "COMMAND_ACK" and h.component == 169][-1]
    assert end_s - begin_s == pytest.approx(takes_s, abs=0.1)
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(4.0)
    assert ask(gcs, Action.RELATIVE_LENGTH, -1.5) == ALL_RESULTS
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(2.5)


def test_length_ends_where_the_line_does(gcs: GroundStation) -> None:
    ask(gcs, Action.RELATIVE_LENGTH, 100.0, 3.0)
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(FULL_LENGTH_M)
    ask(gcs, Action.RELATIVE_LENGTH, -100.0, 3.0)
    assert gcs.last("WINCH_STATUS").line_length == 0.0


def test_a_rate_is_accepted_at_once_and_goes_on_until_another(gcs: GroundStation) -> None:
    assert ask(gcs, Action.RATE, rate_m_s=1.0, wait_s=4.0) == [Result.ACCEPTED]
    assert gcs.last("WINCH_STATUS").speed == pytest.approx(1.0)
    assert ask(gcs, Action.RATE, rate_m_s=-0.5, wait_s=2.0) == [Result.ACCEPTED]
    assert gcs.last("WINCH_STATUS").speed == pytest.approx(-0.5)
    assert ask(gcs, Action.RATE, rate_m_s=0.0, wait_s=3.0) == [Result.ACCEPTED]
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(3.0, abs=0.1)
    assert Flag.MOVING not in flags(gcs)


def test_lock_is_instant_but_only_fully_retracted(gcs: GroundStation) -> None:
    assert ask(gcs, Action.RELATIVE_LENGTH, 5.0, 1.0, wait_s=2.0) == [Result.IN_PROGRESS]
    assert ask(gcs, Action.LOCK, wait_s=0.0) == [Result.TEMPORARILY_REJECTED]
    gcs.fly(5.0)
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(5.0), "a refusal stops nothing"
    ask(gcs, Action.RETRACT)
    assert Flag.LOCKED not in flags(gcs)
    assert ask(gcs, Action.LOCK, wait_s=0.0) == [Result.ACCEPTED]
    gcs.fly(1.1)
    assert Flag.LOCKED in flags(gcs)


@pytest.mark.parametrize(("action", "shown"), [(Action.HOLD, Flag(0)), (Action.RELAXED, Flag.CLUTCH_ENGAGED)])
def test_hold_and_relax_stop_it_at_once(gcs: GroundStation, action: Action, shown: Flag) -> None:
    assert ask(gcs, Action.RELATIVE_LENGTH, 5.0, 1.0, wait_s=2.0) == [Result.IN_PROGRESS]
    assert ask(gcs, action, wait_s=3.0) == [Result.CANCELLED, Result.ACCEPTED]
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(2.0, abs=0.1)
    assert flags(gcs) == Flag.HEALTHY | shown


def test_retract_takes_all_the_line_in(gcs: GroundStation) -> None:
    ask(gcs, Action.RELATIVE_LENGTH, 6.0, 3.0)
    assert ask(gcs, Action.RETRACT) == ALL_RESULTS
    assert Flag.RETRACTING in seen_flags(gcs)
    assert Flag.FULLY_RETRACTED in flags(gcs)


def test_load_payload_presents_the_hook(gcs: GroundStation) -> None:
    assert ask(gcs, Action.LOAD_PAYLOAD) == ALL_RESULTS
    assert 0.0 < gcs.last("WINCH_STATUS").line_length < 1.0


def test_abandoned_line_is_gone_until_a_new_one_is_loaded(gcs: GroundStation) -> None:
    assert ask(gcs, Action.ABANDON_LINE) == ALL_RESULTS
    assert gcs.last("WINCH_STATUS").line_length == pytest.approx(FULL_LENGTH_M)
    assert Flag.ABANDON_LINE in seen_flags(gcs)
    for impossible in (Action.RETRACT, Action.DELIVER, Action.LOAD_PAYLOAD):
        assert ask(gcs, impossible, wait_s=0.1) == [Result.FAILED]
    assert ask(gcs, Action.RATE, rate_m_s=-1.0, wait_s=0.1) == [Result.FAILED]
    assert ask(gcs, Action.LOAD_LINE) == ALL_RESULTS
    assert Flag.LOAD_LINE in seen_flags(gcs)
    assert ask(gcs, Action.LOAD_PAYLOAD) == ALL_RESULTS


# refusals ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("action", [10, -1, 77, 1.5, NAN])
def test_an_action_that_does_not_exist_is_denied_and_stops_nothing(gcs: GroundStation, action: float) -> None:
    ask(gcs, Action.RELATIVE_LENGTH, 3.0, 1.0, wait_s=1.0)
    assert ask(gcs, action, wait_s=5.0) == [Result.DENIED, Result.ACCEPTED]


@pytest.mark.parametrize("action", [Action.RELATIVE_LENGTH, Action.RATE])
def test_an_action_without_the_parameter_it_needs_is_denied(gcs: GroundStation, action: Action) -> None:
    assert ask(gcs, action, wait_s=0.1) == [Result.DENIED]


@pytest.mark.parametrize("action", SEQUENCES)
def test_a_sequence_again_while_it_runs_is_rejected_for_the_moment(gcs: GroundStation, action: Action) -> None:
    ask(gcs, Action.RELATIVE_LENGTH, 2.0)
    gcs.vehicle.state.body.up_m = 5.0
    assert ask(gcs, action, wait_s=0.1) == [Result.IN_PROGRESS]
    assert ask(gcs, action) == [Result.TEMPORARILY_REJECTED, Result.ACCEPTED]


@pytest.mark.parametrize("action", [*SEQUENCES, Action.RELATIVE_LENGTH, Action.RATE])
def test_a_stuck_drum_fails(gcs: GroundStation, action: Action) -> None:
    device(gcs).stuck = True
    assert ask(gcs, action, 3.0, 1.0, wait_s=0.1) == [Result.FAILED]
