"""What the commander does by itself, cycle by cycle: taking off, landing, the end of a mission, disarming."""

from __future__ import annotations

import pytest

from app.simulator.wire import LandedState, Mode, Result
from tests.support.airborne_vehicle import Airborne


def standing(**params: float) -> Airborne:
    air = Airborne(at=(0.0, 0.0, 0.0), **params)
    air.status.armed = False
    air.land()
    return air


def landed_again(mode: Mode = Mode.LAND) -> Airborne:
    """Took off, and lands in this cycle."""
    air = standing(COM_DISARM_LAND=4.0, COM_DISARM_PRFLT=9.0)
    air.commander.arm(force=False)
    air.commander.change_mode(mode)
    for landed in (False, True):
        air.land(landed)
        air.run(air.commander.step)
    return air


@pytest.mark.parametrize(("mode", "then"), [(Mode.MISSION, Mode.LOITER), (Mode.RTL, Mode.RTL)])
def test_a_mission_that_ends_in_the_air_goes_over_to_hold(mode: Mode, then: Mode) -> None:
    air = Airborne()
    air.commander.change_mode(mode)
    air.run(air.commander.step)
    assert air.status.mode is mode
    air.result.finished = True
    air.run(air.commander.step)
    assert (air.status.mode, air.commander.intended) == (then, then)


def test_a_mission_that_ends_on_the_ground_stays_in_its_mode() -> None:
    air = standing(COM_DISARM_LAND=4.0, COM_DISARM_PRFLT=9.0)
    air.commander.arm(force=False)
    air.commander.change_mode(Mode.MISSION)
    air.result.finished = True
    air.run(air.commander.step)
    assert air.status.mode is Mode.MISSION


@pytest.mark.parametrize("finished", [True, False])
def test_what_became_of_a_mission_is_nothing_to_a_landing_in_another_mode(finished: bool) -> None:
    air = landed_again()
    air.result.finished = finished
    assert air.until(air.commander.step, lambda: not air.status.armed) == pytest.approx(4.0, abs=0.05)
    assert air.said[-1] == "Disarmed by landing"


def test_who_takes_off_again_within_the_wait_stays_armed() -> None:
    air = landed_again()
    air.run(air.commander.step, 3.0)
    air.land(False)
    air.run(air.commander.step, 5.0)
    assert air.status.armed


def test_a_flight_counts_only_until_the_next_arming() -> None:
    air = landed_again()
    air.until(air.commander.step, lambda: not air.status.armed)
    air.commander.arm(force=False)
    assert air.until(air.commander.step, lambda: not air.status.armed) == pytest.approx(9.0, abs=0.05)
    assert air.said[-1] == "Disarmed by auto preflight disarming"


@pytest.mark.parametrize("limit_s", [0.0, -1.0])
def test_a_limit_of_0_or_less_disarms_nobody(limit_s: float) -> None:
    air = standing(COM_DISARM_PRFLT=limit_s)
    air.commander.arm(force=False)
    air.run(air.commander.step, 15.0)
    assert air.status.armed
    other = landed_again()
    other.params.set("COM_DISARM_LAND", limit_s)
    other.run(other.commander.step, 15.0)
    assert other.status.armed


@pytest.mark.parametrize("mode", [Mode.LAND, Mode.MISSION])
def test_a_limit_below_a_second_disarms_so_soon(mode: Mode) -> None:
    air = standing(COM_DISARM_PRFLT=0.5)
    air.commander.arm(force=False)
    assert air.until(air.commander.step, lambda: not air.status.armed) == pytest.approx(0.5, abs=0.03)
    other = landed_again(mode)
    other.result.finished = True
    other.params.set("COM_DISARM_LAND", 0.5)
    assert other.until(other.commander.step, lambda: not other.status.armed) <= 0.52


def test_arming_in_the_air_is_no_takeoff() -> None:
    air = Airborne()
    air.status.armed = False
    air.commander.arm(force=True)
    air.run(air.commander.step)
    assert air.said == ["Armed by external command"]


def test_arming_sets_home_where_it_stands() -> None:
    air = standing()
    air.state.body.east_m = 0.5
    air.commander.arm(force=False)
    assert air.context.home.east_m == 0.5


@pytest.mark.parametrize(
    ("state", "force", "disarmed"),
    [
        (LandedState.IN_AIR, False, False),
        (LandedState.IN_AIR, True, True),
        (LandedState.UNDEFINED, False, True),
    ],
)
def test_in_the_air_disarming_needs_force_unless_nobody_knows_where_it_is(
    state: LandedState, force: bool, disarmed: bool
) -> None:
    air = Airborne()
    air.status.landed_state = state
    result = air.commander.disarm(force)
    assert result is (Result.ACCEPTED if disarmed else Result.TEMPORARILY_REJECTED)
    assert air.status.armed is not disarmed
    assert air.said == [("Disarmed by external command" if disarmed else "Disarming denied: not landed")]


def test_a_mode_that_does_not_exist_is_rejected_and_said() -> None:
    air = Airborne()
    assert air.commander.unsupported_mode() is Result.TEMPORARILY_REJECTED
    assert (air.said, air.events) == (["Unsupported auto mode"], [("commander_unsupported_auto_mode",)])
