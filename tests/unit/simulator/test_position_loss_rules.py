"""Loss of the position, without a flight: what is said, what is remembered, and what a reboot forgets."""

from __future__ import annotations

import pytest

from app.simulator.commander import StatusOutput
from app.simulator.failsafes import PositionLossFailsafe
from app.simulator.wire import Mode
from tests.support.airborne_vehicle import Airborne

ENTERED = ("commander_failsafe_enter_generic", Mode.MISSION, 8)


def flying(mode: Mode = Mode.MISSION) -> tuple[Airborne, PositionLossFailsafe]:
    air = Airborne()
    air.commander.change_mode(mode)
    loss = PositionLossFailsafe(air.status, air.faults, air.clock, air.commander, StatusOutput(air.text, air.event))
    loss.boot()
    assert not air.status.position_valid, "nothing was received yet"
    air.run(loss.step, 0.1)
    assert air.status.position_valid
    return air, loss


def descending(mode: Mode = Mode.MISSION) -> tuple[Airborne, PositionLossFailsafe]:
    air, loss = flying(mode)
    air.faults.gps_lost = True
    air.run(loss.step, 5.1)
    return air, loss


def regain(air: Airborne, loss: PositionLossFailsafe) -> None:
    air.faults.gps_lost = False
    air.run(loss.step)


def test_the_fix_is_lost_at_once_and_the_position_after_five_seconds() -> None:
    air, loss = flying()
    air.faults.gps_lost = True
    air.run(loss.step)
    assert (air.status.gps_lost, air.status.position_valid, air.flown) == (True, True, (Mode.MISSION, False))
    assert air.until(loss.step, lambda: not air.status.position_valid) == pytest.approx(5.0, abs=0.05)


def test_the_descent_is_said_once() -> None:
    air, loss = descending()
    air.run(loss.step, 5.0)
    assert (air.said, air.events) == (["Failsafe activated"], [ENTERED])
    assert air.flown == (Mode.DESCEND, True)


def test_the_position_that_is_back_gives_the_users_mode_back_once() -> None:
    air, loss = descending()
    regain(air, loss)
    assert air.flown == (Mode.MISSION, False)
    air.commander.change_mode(Mode.LAND)
    air.run(loss.step)
    assert air.flown == (Mode.LAND, False)


def test_a_landing_by_the_user_becomes_a_blind_one_and_his_own_again() -> None:
    air, loss = descending(Mode.LAND)
    assert air.flown == (Mode.DESCEND, True)
    regain(air, loss)
    assert air.flown == (Mode.LAND, False)


def test_what_another_failsafe_wants_meanwhile_is_flown_when_the_position_is_back() -> None:
    air, loss = descending()
    air.commander.force_mode(Mode.RTL)
    air.run(loss.step)
    assert air.flown == (Mode.DESCEND, True)
    assert air.said == ["Failsafe activated"]
    regain(air, loss)
    assert air.flown == (Mode.RTL, True)


def test_who_flies_it_without_a_position_meanwhile_keeps_it() -> None:
    air, loss = descending()
    air.stream_attitude()
    air.commander.change_mode(Mode.OFFBOARD)
    air.run(loss.step)
    assert air.flown == (Mode.OFFBOARD, False)
    regain(air, loss)
    assert air.flown == (Mode.OFFBOARD, False)


def test_a_descent_that_was_flown_out_of_begins_again_without_a_word() -> None:
    air, loss = descending()
    air.stream_attitude()
    air.commander.change_mode(Mode.OFFBOARD)
    air.run(loss.step, 1.0)
    air.stream_position()
    air.run(loss.step)
    assert (air.flown, air.said) == ((Mode.DESCEND, True), ["Failsafe activated"])
    regain(air, loss)
    assert air.flown == (Mode.OFFBOARD, False)


def test_a_terminated_vehicle_loses_its_position_without_a_word() -> None:
    air, loss = flying()
    air.commander.terminate()
    air.faults.gps_lost = True
    air.run(loss.step, 10.0)
    assert (air.said, air.status.mode) == ([], Mode.TERMINATION)


def test_a_disarmed_vehicle_does_nothing_and_remembers_nothing() -> None:
    air, loss = descending()
    air.commander.disarm(force=True)
    air.run(loss.step)
    assert air.flown == (Mode.MISSION, False)
    assert len(air.events) == 2, "the descent and the disarming"
    regain(air, loss)
    air.commander.change_mode(Mode.LAND)
    air.status.armed = True
    air.run(loss.step)
    assert air.flown == (Mode.LAND, False)


def test_a_reboot_forgets_the_last_fix() -> None:
    air, loss = flying()
    air.status.armed = False
    air.faults.gps_lost = True
    air.clock.restart()
    loss.boot()
    air.run(loss.step)
    assert not air.status.position_valid
