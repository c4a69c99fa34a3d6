"""Loss of the ground station, without a flight: who is spared, what is said, what a reboot forgets."""

from __future__ import annotations

import pytest

from app.simulator.commander import StatusOutput
from app.simulator.failsafes import LinkLossFailsafe
from app.simulator.wire import Mode
from tests.support.airborne_vehicle import Airborne

LOST_S = 12.4
ACTIVATED, REGAINED = "Failsafe activated", "GCS connection regained"
HOLD, TERMINATE, DISARM = 1, 5, 6


def received(action: int, mode: Mode = Mode.MISSION, speed: float = 1.0) -> tuple[Airborne, LinkLossFailsafe]:
    """A ground station was heard a moment ago."""
    air = Airborne(NAV_DLL_ACT=action)
    air.clock.change_speed(speed)
    air.commander.change_mode(mode)
    link = LinkLossFailsafe(air.status, air.params, air.clock, air.commander, StatusOutput(air.text, air.event))
    link.boot()
    link.on_gcs_heartbeat()
    return air, link


def lost(action: int, mode: Mode = Mode.MISSION) -> tuple[Airborne, LinkLossFailsafe]:
    air, link = received(action, mode)
    air.run(link.step, LOST_S + 0.1)
    return air, link


def test_before_a_ground_station_was_heard_there_is_none_to_lose_and_none_to_regain() -> None:
    air, link = received(2)
    link.boot()
    assert air.status.gcs_lost
    air.run(link.step, 60.0)
    assert (air.flown, air.events) == ((Mode.MISSION, False), [])
    link.on_gcs_heartbeat()
    assert (air.said, air.events, air.status.gcs_lost) == ([], [], False)


def test_the_silence_is_measured_on_the_wall_where_time_runs_faster() -> None:
    air, link = received(HOLD, speed=3.0)
    assert air.until(link.step, lambda: air.status.gcs_lost) == pytest.approx(10.0 + 3.0 * 2.4, abs=0.03)


def test_each_heartbeat_begins_the_time_anew() -> None:
    air, link = received(HOLD)
    air.run(link.step, 8.0)
    link.on_gcs_heartbeat()
    assert air.until(link.step, lambda: air.status.gcs_lost) == pytest.approx(LOST_S, abs=0.03)
    assert REGAINED not in air.said


def test_the_loss_and_the_hold_are_said_once_and_the_action_when_it_comes() -> None:
    air, link = lost(2)
    said = [("commander_gcs_lost",), ("commander_failsafe_enter_hold", Mode.MISSION, 6, 5, 2)]
    assert (air.said, air.events, air.flown) == ([ACTIVATED], said, (Mode.LOITER, True))
    air.run(link.step, 4.8)
    assert air.said == [ACTIVATED]
    air.run(link.step, 20.0)
    said.append(("commander_failsafe_enter", Mode.MISSION, 6, 2))
    assert (air.said, air.events, air.flown) == ([ACTIVATED] * 2, said, (Mode.RTL, True))


def test_the_link_that_is_back_is_said_by_text_and_event_once() -> None:
    air, link = lost(0)
    link.on_gcs_heartbeat()
    link.on_gcs_heartbeat()
    assert (air.said, air.events) == ([REGAINED], [("commander_gcs_lost",), ("commander_dl_regained",)])


def test_the_action_comes_once() -> None:
    air, link = lost(2)
    air.run(link.step, 6.0)
    air.commander.change_mode(Mode.LOITER)
    air.run(link.step, 6.0)
    assert air.flown == (Mode.LOITER, False)


@pytest.mark.parametrize(("action", "then"), [(HOLD, Mode.LOITER), (2, Mode.RTL), (3, Mode.LAND)])
def test_nav_dll_act_names_what_follows_the_hold(action: int, then: Mode) -> None:
    air, link = lost(action)
    assert air.flown == (Mode.LOITER, True)
    air.run(link.step, 6.0)
    assert air.flown == (then, True)


def test_a_heartbeat_during_the_hold_forgets_the_action_and_stays_in_the_hold() -> None:
    air, link = lost(2)
    link.on_gcs_heartbeat()
    air.run(link.step, 8.0)
    assert air.flown == (Mode.LOITER, True)


def test_who_took_over_during_the_hold_keeps_the_vehicle() -> None:
    air, link = lost(2)
    air.commander.change_mode(Mode.POSCTL)
    air.run(link.step, 8.0)
    assert air.flown == (Mode.POSCTL, False)


@pytest.mark.parametrize("mode", [Mode.RTL, Mode.LAND])
def test_who_comes_down_already_is_left_alone(mode: Mode) -> None:
    air, _ = lost(2, mode)
    assert (air.flown, air.said) == ((mode, False), [])


def test_on_the_ground_there_is_no_hold() -> None:
    air, link = received(2)
    air.land()
    air.run(link.step, LOST_S + 8.0)
    assert (air.flown, air.said) == ((Mode.MISSION, False), [])


@pytest.mark.parametrize("action", [0, 4, 7])
def test_without_an_action_the_loss_is_only_an_event(action: int) -> None:
    air, link = lost(action)
    air.run(link.step, 10.0)
    assert (air.flown, air.said, air.events) == ((Mode.MISSION, False), [], [("commander_gcs_lost",)])


def test_an_action_that_is_switched_off_during_the_hold_does_not_come() -> None:
    air, link = lost(2)
    air.params.set("NAV_DLL_ACT", 0)
    air.run(link.step, 10.0)
    assert air.flown == (Mode.LOITER, True)


def test_who_is_disarmed_during_the_hold_is_left_alone() -> None:
    air, link = lost(2)
    air.commander.disarm(force=True)
    air.commander.change_mode(Mode.LOITER)
    air.run(link.step, 10.0)
    assert air.flown == (Mode.LOITER, False)


def test_a_reboot_during_the_hold_forgets_the_action() -> None:
    air, link = lost(2)
    link.boot()
    air.run(link.step, 10.0)
    assert air.status.mode is Mode.LOITER


@pytest.mark.parametrize("action", [HOLD, 2, 3, TERMINATE, DISARM])
def test_nothing_is_done_to_a_disarmed_vehicle(action: int) -> None:
    air, link = received(action)
    air.status.armed = False
    air.run(link.step, LOST_S + 10.0)
    assert (air.flown, air.said) == ((Mode.MISSION, False), [])


@pytest.mark.parametrize("action", [TERMINATE, DISARM])
def test_the_motors_are_stopped_in_a_return_and_not_in_a_landing(action: int) -> None:
    landing, _ = lost(action, Mode.LAND)
    assert (landing.status.armed, landing.flown, landing.said) == (True, (Mode.LAND, False), [])
    returning, _ = lost(action, Mode.RTL)
    assert (returning.status.armed, returning.status.mode) == (
        (True, Mode.TERMINATION) if action == TERMINATE else (False, Mode.LOITER)
    )


def test_a_stop_of_the_motors_is_said_and_is_all() -> None:
    air, _ = lost(DISARM)
    assert air.said == [ACTIVATED, "Disarmed by failsafe"]
    assert air.events == [("commander_gcs_lost",), ("commander_disarmed_by", 14)]
    other, other_link = lost(TERMINATE)
    other.run(other_link.step, 10.0)
    assert (other.said, other.events) == ([ACTIVATED], [("commander_gcs_lost",)])
    assert other.flown == (Mode.TERMINATION, True)


def test_a_terminated_vehicle_stays_so_whatever_the_link_does() -> None:
    air, link = received(2)
    air.commander.terminate()
    air.run(link.step, LOST_S + 10.0)
    assert air.status.mode is Mode.TERMINATION
