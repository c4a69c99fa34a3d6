"""A fence breached in flight, without the flight: limits, words, delays and takeovers, each alone."""

from __future__ import annotations

import pytest

from app.simulator.commander import StatusOutput
from app.simulator.failsafe_action import FailsafeAction
from app.simulator.geofence_breach import GeofenceBreach
from app.simulator.mission.geofence import CIRCLE_INCLUSION, Geofence
from app.simulator.mission.item import Item
from app.simulator.wire import Mode
from tests.support.airborne_vehicle import FRAME, Airborne

RADIUS_M, INSIDE, OUTSIDE = 50.0, (0.0, 30.0, 20.0), (0.0, 60.0, 20.0)
OUT = "Geofence: approaching or outside geofence"
FAR, HIGH = "Geofence: exceeding maximum distance to Home", "Geofence: exceeding maximum altitude above Home"
ACTIVATED = "Failsafe activated"
ENTER, WARN = "commander_failsafe_enter_generic", "commander_failsafe_enter_generic_warn"
NOTHING, SAY, HOLD, RETURN, TERMINATE, LAND = range(6)


class Fenced:
    """Flies a mission in a circle of 50 m."""

    def __init__(self, action: int, fence: bool = True, names_limit: bool = True, **params: float) -> None:
        self.air = air = Airborne(at=INSIDE, GF_ACTION=action, **params)
        self.held: list[tuple[tuple[float, float], float]] = []
        x, y = (round(degrees * 1e7) for degrees in FRAME.to_global(0.0, 0.0))
        circle = Item(CIRCLE_INCLUSION, 0, 1, RADIUS_M, 0.0, 0.0, 0.0, x, y, 0.0)
        area = Geofence((circle,) if fence else (), FRAME)
        output = StatusOutput(air.text, air.event)
        self.breach = GeofenceBreach(
            air.state, air.params, air.clock,
            FailsafeAction(air.status, air.params, air.clock, air.commander, output), lambda: area,
            lambda point, up_m: self.held.append((point, up_m)), output, names_limit,
        )  # fmt: skip
        air.commander.change_mode(Mode.MISSION)
        self.step(1.0)
        assert not self.breached
        assert air.said == air.events == []

    @property
    def breached(self) -> bool:
        return self.air.status.fence_breached

    def step(self, seconds: float = 0.3) -> Fenced:
        self.air.run(self.breach.step, seconds)
        return self

    def go(self, *place: float) -> Fenced:
        self.air.place(place[0], place[1], place[2])
        return self.step()


# what is seen -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("params", "within", "beyond", "text", "event"),
    [
        ({"GF_MAX_HOR_DIST": 40.0}, (39.0, 0.0, 20.0), (0.0, -41.0, 20.0), FAR, "check_gf_violation_max_hor_dist"),
        ({"GF_MAX_VER_DIST": 25.0}, (30.0, 0.0, 24.0), (30.0, 0.0, 26.0), HIGH, "check_gf_violation_max_alt"),
    ],
)
def test_both_distances_are_from_home(
    params: dict[str, float], within: tuple[float, ...], beyond: tuple[float, ...], text: str, event: str
) -> None:
    fenced = Fenced(SAY, fence=False, **params).go(*within)
    assert not fenced.breached
    fenced.go(*beyond)
    assert (fenced.breached, fenced.air.said[0], fenced.air.events[0]) == (True, text, (event,))
    other = Fenced(SAY, fence=False, **params)
    home = other.air.status.home
    assert home is not None
    home.north_m, home.east_m, home.up_m = 0.0, -30.0, 10.0
    assert not other.go(*beyond).breached


@pytest.mark.parametrize(
    ("params", "place", "breached"),
    [
        ({"GF_MAX_HOR_DIST": 40.0}, (0.0, 40.0, 20.0), True),
        ({"GF_MAX_VER_DIST": 25.0}, (0.0, 30.0, 25.0), True),
        ({"GF_MAX_HOR_DIST": 0.0, "GF_MAX_VER_DIST": 0.0}, (0.0, 900.0, 900.0), False),
    ],
)
def test_a_distance_is_exceeded_where_it_is_reached_and_0_is_none(
    params: dict[str, float], place: tuple[float, ...], breached: bool
) -> None:
    assert Fenced(SAY, fence=False, **params).go(*place).breached is breached


@pytest.mark.parametrize("name", ["GF_MAX_HOR_DIST", "GF_MAX_VER_DIST"])
def test_half_a_metre_is_a_limit_too(name: str) -> None:
    fenced = Fenced(NOTHING, fence=False, **{name: 0.5})
    fenced.air.params.set("GF_ACTION", SAY)
    assert fenced.step().breached


def test_0_does_not_look() -> None:
    fenced = Fenced(NOTHING).go(*OUTSIDE)
    assert (fenced.breached, fenced.air.said) == (False, [])


def test_without_home_there_is_no_distance_from_it() -> None:
    fenced = Fenced(SAY, fence=False, GF_MAX_HOR_DIST=40.0, GF_MAX_VER_DIST=25.0)
    fenced.air.status.home = None
    assert not fenced.go(90.0, 90.0, 90.0).breached


def test_all_that_is_exceeded_is_said_in_the_order_of_the_check() -> None:
    fenced = Fenced(SAY, GF_MAX_HOR_DIST=40.0, GF_MAX_VER_DIST=25.0).go(60.0, 0.0, 30.0)
    assert fenced.air.said == [FAR, HIGH, OUT, ACTIVATED]
    checks = ["check_gf_violation_max_hor_dist", "check_gf_violation_max_alt", "check_gf_violation_custom_gf"]
    assert [name for name, *_ in fenced.air.events] == [*checks, WARN]


def test_before_v1_15_one_text_says_it_all_and_no_event_does() -> None:
    fenced = Fenced(SAY, names_limit=False, GF_MAX_HOR_DIST=40.0).go(*OUTSIDE)
    assert fenced.air.said == ["Approaching on Geofence", ACTIVATED]
    assert [name for name, *_ in fenced.air.events] == [WARN]


def test_it_looks_five_times_a_second_and_only_where_it_knows_that_it_is() -> None:
    fenced = Fenced(SAY)
    air = fenced.air
    air.until(fenced.breach.step, lambda: False, 0.3)
    for _ in range(3):
        for place, there in ((OUTSIDE, True), (INSIDE, False)):
            air.place(*place)
            late_s = air.until(fenced.breach.step, lambda there=there: fenced.breached is there, 1.0)
            assert late_s == pytest.approx(0.2, abs=0.021)
    air.status.position_valid = False
    assert not fenced.go(*OUTSIDE).breached


def test_power_up_looks_at_once_and_takes_nothing_for_breached() -> None:
    fenced = Fenced(SAY).go(*OUTSIDE)
    assert fenced.breached
    fenced.air.clock.restart()
    fenced.breach.boot()
    assert not fenced.breached
    fenced.air.clock.now_s = 0.0
    fenced.breach.step()
    assert fenced.breached


# what is done -----------------------------------------------------------------------------------------------


def test_on_the_ground_a_breach_is_said_and_nothing_done() -> None:
    fenced = Fenced(HOLD)
    fenced.air.status.armed = False
    fenced.go(*OUTSIDE)
    assert (fenced.breached, fenced.air.said, fenced.air.flown) == (True, [OUT], (Mode.MISSION, False))


def test_1_says_so_and_nothing_more() -> None:
    fenced = Fenced(SAY).go(*OUTSIDE)
    fenced.step(10.0)
    assert fenced.air.events[1:] == [(WARN, Mode.MISSION)]
    assert (fenced.air.said, fenced.air.flown) == ([OUT, ACTIVATED], (Mode.MISSION, False))


def test_an_action_that_does_not_exist_is_a_warning() -> None:
    fenced = Fenced(9).go(*OUTSIDE)
    assert (fenced.air.events[-1], fenced.air.flown) == ((WARN, Mode.MISSION), (Mode.MISSION, False))


def test_2_holds_at_the_place_of_the_breach_at_once() -> None:
    fenced = Fenced(HOLD).go(*OUTSIDE)
    assert fenced.held == [((0.0, 60.0), 20.0)]
    assert fenced.air.events[1:] == [(ENTER, Mode.MISSION, 5)]
    assert (fenced.air.said, fenced.air.flown) == ([OUT, ACTIVATED], (Mode.LOITER, True))


@pytest.mark.parametrize(("delay_s", "said_s"), [(3.6, 4), (3.4, 3)])
@pytest.mark.parametrize(("action", "number", "then"), [(RETURN, 6, Mode.RTL), (LAND, 7, Mode.LAND)])
def test_3_and_5_hold_for_com_fail_act_t_and_say_both(
    action: int, number: int, then: Mode, delay_s: float, said_s: int
) -> None:
    fenced = Fenced(action, COM_FAIL_ACT_T=delay_s).go(*OUTSIDE)
    air = fenced.air
    hold = f"Failsafe activated, entering Hold for {said_s} seconds"
    assert (air.said, fenced.held, air.flown) == ([OUT, hold], [], (Mode.LOITER, True))
    assert air.events[1:] == [("commander_failsafe_enter_generic_hold", Mode.MISSION, number, said_s)]
    took_s = air.until(fenced.breach.step, lambda: air.status.mode is not Mode.LOITER)
    assert delay_s - 0.3 <= took_s <= delay_s + 0.02
    fenced.step(10.0)
    assert air.flown == (then, True)
    assert air.events[2:] == [(ENTER, Mode.MISSION, number)], "once"
    assert air.said[2:] == [ACTIVATED]


@pytest.mark.parametrize(("delay_s", "at_once"), [(0.1, True), (0.2, False)])
def test_a_delay_of_a_tenth_of_a_second_is_none(delay_s: float, at_once: bool) -> None:
    fenced = Fenced(RETURN, COM_FAIL_ACT_T=delay_s)
    fenced.air.place(*OUTSIDE)
    fenced.air.until(fenced.breach.step, lambda: fenced.breached)
    assert fenced.air.flown == (Mode.RTL if at_once else Mode.LOITER, True)
    if at_once:
        assert (fenced.air.said, fenced.air.events[1:]) == ([OUT, ACTIVATED], [(ENTER, Mode.MISSION, 6)])


def test_4_stops_the_motors_and_says_so() -> None:
    fenced = Fenced(TERMINATE).go(*OUTSIDE)
    assert fenced.air.events[1:] == [(ENTER, Mode.MISSION, 10)]
    assert (fenced.air.said, fenced.air.flown) == ([OUT, ACTIVATED], (Mode.TERMINATION, True))


@pytest.mark.parametrize(("action", "landing"), [(RETURN, True), (LAND, False), (HOLD, False)])
def test_who_comes_down_is_not_made_to_return(action: int, landing: bool) -> None:
    fenced = Fenced(action)
    fenced.air.commander.change_mode(Mode.LAND)
    fenced.go(*OUTSIDE)
    assert (fenced.air.flown == (Mode.LAND, False)) is landing
    assert (fenced.air.events[-1] == (WARN, Mode.LAND)) is landing


# how long ---------------------------------------------------------------------------------------------------


def test_a_return_makes_an_end_of_the_breach_inside_and_goes_on() -> None:
    fenced = Fenced(RETURN, COM_FAIL_ACT_T=0.0).go(*OUTSIDE)
    fenced.go(*INSIDE)
    assert (fenced.breached, fenced.air.flown) == (False, (Mode.RTL, True))


def test_a_hold_makes_no_end_of_the_breach_and_what_replaced_it_does() -> None:
    fenced = Fenced(HOLD).go(*OUTSIDE)
    assert fenced.go(*INSIDE).breached
    fenced.air.commander.force_mode(Mode.RTL)
    assert not fenced.go(*INSIDE).breached


def test_a_hold_by_the_user_makes_an_end_of_it_inside() -> None:
    fenced = Fenced(SAY)
    fenced.air.commander.change_mode(Mode.LOITER)
    assert fenced.go(*OUTSIDE).breached
    assert not fenced.go(*INSIDE).breached


@pytest.mark.parametrize("action", [HOLD, RETURN, LAND])
def test_another_mode_without_a_user_is_replaced_by_the_action(action: int) -> None:
    fenced = Fenced(action, COM_FAIL_ACT_T=0.0).go(*OUTSIDE)
    wanted = fenced.air.flown
    fenced.air.commander.resume(Mode.MISSION)
    assert fenced.step(0.02).air.flown == wanted


SEVERITIES = [Mode.LOITER, Mode.RTL, Mode.LAND, Mode.TERMINATION]


@pytest.mark.parametrize("other", SEVERITIES)
@pytest.mark.parametrize(("action", "own"), [(HOLD, Mode.LOITER), (RETURN, Mode.RTL), (LAND, Mode.LAND)])
def test_of_two_failsafes_the_worse_is_flown(action: int, own: Mode, other: Mode) -> None:
    fenced = Fenced(action, COM_FAIL_ACT_T=0.0).go(*OUTSIDE)
    fenced.air.commander.force_mode(other)
    worse = max(own, other, key=SEVERITIES.index)
    assert fenced.step(0.02).air.status.mode is worse


@pytest.mark.parametrize("action", [HOLD, RETURN])
def test_a_user_who_changes_the_mode_ends_the_action_and_its_delay(action: int) -> None:
    fenced = Fenced(action).go(*OUTSIDE)
    fenced.air.commander.change_mode(Mode.POSCTL)
    assert fenced.step(10.0).air.flown == (Mode.POSCTL, False)


@pytest.mark.parametrize("action", [HOLD, RETURN])
def test_a_disarming_ends_the_action_and_its_delay(action: int) -> None:
    fenced = Fenced(action).go(*OUTSIDE)
    fenced.air.commander.disarm(force=True)
    assert fenced.step(10.0).air.flown == (Mode.MISSION, False)


@pytest.mark.parametrize("action", [HOLD, RETURN])
def test_a_reboot_ends_the_action_and_its_delay(action: int) -> None:
    fenced = Fenced(action).go(*OUTSIDE)
    fenced.breach.boot()
    fenced.air.place(*INSIDE)
    fenced.air.commander.resume(Mode.MISSION)
    assert fenced.step(10.0).air.flown == (Mode.MISSION, False)
