"""A fence breached in flight: what counts as a breach, what GF_ACTION does, and who can take over."""

from __future__ import annotations

import pytest

from app.simulator.events import EVENTS
from app.simulator.mission.geofence import CIRCLE_EXCLUSION, CIRCLE_INCLUSION, POLYGON_EXCLUSION, POLYGON_INCLUSION
from app.simulator.params import Value
from app.simulator.wire import Cmd, LandedState, Mode, Result
from tests.support.breaching_vehicle import BORDER_M, FENCE, INCLUSION, UP_M, northwards, polygon
from tests.support.simulated_vehicle import GroundStation, Plan

TEXT = "Geofence: approaching or outside geofence"


def circle(command: int, north_m: float, radius_m: float) -> list[Plan]:
    return [Plan(command, north_m, 0.0, params=(radius_m, 0.0, 0.0, 0.0))]


def send_north(gcs: GroundStation, up_m: float = UP_M, north_m: float = 120.0) -> None:
    """A DO_REPOSITION over the border: PX4 flies it only where the fence just warns, so it does for that moment."""
    frame = gcs.vehicle.spec.frame
    latitude, longitude = frame.to_global(north_m, 0.0)
    position = (latitude, longitude, frame.altitude_m + up_m)
    params = gcs.vehicle.params
    action = params.integer("GF_ACTION")
    params.set("GF_ACTION", 0)
    assert gcs.command(Cmd.DO_REPOSITION, -1, 1, 0, float("nan"), *position) == [Result.ACCEPTED]
    params.set("GF_ACTION", action)


def breached(gcs: GroundStation) -> bool:
    return gcs.vehicle.state.status.fence_breached


def mode(gcs: GroundStation) -> Mode:
    return gcs.vehicle.state.status.mode


def events(gcs: GroundStation) -> list[str]:
    names = {number: name for name, (number, _, _) in EVENTS.items()}
    return [names[event.id] for event in gcs.messages("EVENT")]


def breaching(fence: list[Plan], airframe: str = "quad", firmware: str = "px4-main", **params: Value) -> GroundStation:
    """Flies over the border; returns in the cycle in which that is seen."""
    gcs = northwards(fence, airframe, firmware, **params)
    send_north(gcs)
    gcs.until(lambda: breached(gcs), 40.0)
    return gcs


# what a breach is -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "fence",
    [
        INCLUSION,
        polygon(POLYGON_EXCLUSION, BORDER_M, 80.0),
        circle(CIRCLE_INCLUSION, 0.0, BORDER_M),
        circle(CIRCLE_EXCLUSION, BORDER_M + 30.0, 30.0),
    ],
)
def test_each_kind_of_area_is_breached_at_its_border_within_a_fifth_of_a_second(fence: list[Plan]) -> None:
    gcs = breaching(fence)
    speed_m_s = gcs.vehicle.state.body.ground_speed_m_s
    assert BORDER_M <= gcs.vehicle.state.body.north_m <= BORDER_M + 0.22 * speed_m_s
    assert gcs.texts()[-2:] == [TEXT, "Failsafe activated"]


def test_it_looks_five_times_a_second_in_the_air_and_on_the_ground() -> None:
    gcs = GroundStation()
    assert gcs.upload(INCLUSION, FENCE) == 0
    gcs.fly(1.0)
    body = gcs.vehicle.state.body
    for phase in range(1, 8):
        gcs.fly(0.26 + 0.04 * phase)
        for north_m in (BORDER_M + 1.0, 0.0):
            body.north_m = north_m
            assert gcs.until(lambda north_m=north_m: breached(gcs) is (north_m > BORDER_M), 1.0) < 0.23


def test_without_a_position_nothing_is_seen() -> None:
    gcs = northwards(INCLUSION, GF_ACTION=1)
    gcs.vehicle.faults.gps_lost = True
    gcs.until(lambda: not gcs.vehicle.state.status.position_valid, 10.0)
    gcs.vehicle.state.body.north_m = 60.0
    gcs.fly(1.0)
    assert not breached(gcs)


def test_the_distance_from_home_is_limited_by_gf_max_hor_dist() -> None:
    gcs = breaching([], GF_MAX_HOR_DIST=BORDER_M)
    assert gcs.vehicle.state.body.north_m == pytest.approx(BORDER_M, abs=1.5)
    assert gcs.texts()[-2] == "Geofence: exceeding maximum distance to Home"
    assert "check_gf_violation_max_hor_dist" in events(gcs)


def test_the_height_above_home_is_limited_by_gf_max_ver_dist() -> None:
    gcs = northwards([], GF_MAX_VER_DIST=25.0)
    send_north(gcs, up_m=60.0, north_m=15.0)
    gcs.until(lambda: breached(gcs), 20.0)
    assert gcs.vehicle.state.body.up_m == pytest.approx(25.0, abs=1.0)
    assert gcs.texts()[-2] == "Geofence: exceeding maximum altitude above Home"


def test_before_v1_15_the_text_does_not_say_which_limit_it_was() -> None:
    gcs = breaching([], firmware="px4-1.14", GF_MAX_HOR_DIST=BORDER_M)
    assert gcs.texts()[-2:] == ["Approaching on Geofence", "Failsafe activated"]


def test_an_action_of_0_does_not_look() -> None:
    gcs = northwards(INCLUSION, GF_ACTION=0)
    send_north(gcs)
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 115.0, 60.0)
    assert not breached(gcs)
    assert TEXT not in gcs.texts()


def test_a_fence_that_was_refused_as_it_came_limits_nothing() -> None:
    """Home is not inside [05_fence_rally]; and it would act where the vehicle flies now."""
    gcs = northwards(polygon(POLYGON_INCLUSION, 100.0, 200.0))
    gcs.upload(polygon(POLYGON_EXCLUSION, 10.0, 20.0), FENCE)
    gcs.fly(2.0)
    assert not breached(gcs)
    assert "Geofence invalid, doesn't contain current vehicle position" in "".join(gcs.texts())


@pytest.mark.parametrize(("firmware", "leaves"), [("px4-main", True), ("px4-1.14", False)])
def test_since_v1_15_it_has_to_be_in_all_inclusions_that_contain_home(firmware: str, leaves: bool) -> None:
    wide, narrow = polygon(POLYGON_INCLUSION, -100.0, 200.0), polygon(POLYGON_INCLUSION, -50.0, BORDER_M)
    gcs = northwards([*wide, *narrow], firmware=firmware)
    send_north(gcs)
    gcs.until(lambda: gcs.vehicle.state.body.north_m > BORDER_M + 5.0, 40.0)
    assert breached(gcs) is leaves


def test_an_inclusion_without_home_is_left_out_by_itself() -> None:
    """PX4 #27099: it may not be flown into, nor does it keep the vehicle out of the other."""
    gcs = northwards([*polygon(POLYGON_INCLUSION, 100.0, 200.0), *INCLUSION])
    assert "Geofence invalid, doesn't contain Home position" in gcs.texts()
    assert not breached(gcs)
    send_north(gcs)
    gcs.until(lambda: breached(gcs), 40.0)
    assert gcs.vehicle.state.body.north_m == pytest.approx(BORDER_M, abs=1.5)


def test_one_cannot_arm_outside_the_fence() -> None:
    gcs = GroundStation(params={"GF_ACTION": 1})
    gcs.upload(INCLUSION, FENCE)
    gcs.fly(1.0)
    gcs.vehicle.state.body.north_m = BORDER_M + 10.0
    gcs.fly(1.0)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    assert "Failsafe activated" not in gcs.texts(), "there is nothing to do on the ground"
    gcs.vehicle.params.set("GF_ACTION", 0)
    gcs.fly(0.3)
    gcs.arm()


# what is done -----------------------------------------------------------------------------------------------


def test_1_warns_and_flies_on() -> None:
    gcs = breaching(INCLUSION, GF_ACTION=1)
    assert gcs.texts()[-2:] == [TEXT, "Failsafe activated"]
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 115.0, 60.0)
    assert gcs.texts().count("Failsafe activated") == 1
    assert "commander_failsafe_enter_generic_warn" in events(gcs)
    assert gcs.last("HEARTBEAT").system_status == 5, "PX4's inFailsafe() counts a warning too (flown)"
    assert gcs.last("HEARTBEAT").custom_mode == gcs.last("CURRENT_MODE").intended_custom_mode == Mode.LOITER


def test_2_holds_where_the_breach_was_seen() -> None:
    gcs = breaching(INCLUSION, GF_ACTION=2)
    at_m = gcs.vehicle.state.body.north_m
    assert mode(gcs) is Mode.LOITER
    gcs.fly(15.0)
    assert gcs.distance_to(at_m, 0.0) < 0.5
    assert gcs.last("HEARTBEAT").system_status == 5
    assert gcs.texts().count("Failsafe activated") == 1, "it hangs over the border, and that is said once"


@pytest.mark.parametrize(("action", "then"), [(3, Mode.RTL), (5, Mode.LAND)])
def test_3_returns_and_5_lands_after_a_hold_of_com_fail_act_t(action: int, then: Mode) -> None:
    gcs = breaching(INCLUSION, GF_ACTION=action, COM_FAIL_ACT_T=4.0)
    assert mode(gcs) is Mode.LOITER
    assert "".join(gcs.texts()[-2:]).endswith("Failsafe activated, entering Hold for 4 seconds")
    assert events(gcs)[-1] == "commander_failsafe_enter_generic_hold"
    assert gcs.until(lambda: mode(gcs) is not Mode.LOITER, 10.0) == pytest.approx(4.0, abs=0.03)
    assert mode(gcs) is then
    assert "Failsafe activated" in gcs.texts()
    assert "commander_failsafe_enter_generic" in events(gcs)
    gcs.until(lambda: not gcs.armed, 120.0)
    home_m = gcs.distance_to(0.0, 0.0)  # in hold it flew on to where it had been sent: the mode was the same
    assert home_m < 1.0 if then is Mode.RTL else BORDER_M < home_m < 100.0
    gcs.fly(0.1)
    assert mode(gcs) is Mode.LOITER, "disarmed the failsafe is over"


def test_without_that_time_it_returns_at_once() -> None:
    gcs = breaching(INCLUSION, GF_ACTION=3, COM_FAIL_ACT_T=0.0)
    assert mode(gcs) is Mode.RTL
    assert "entering Hold" not in "".join(gcs.texts())


def test_a_vehicle_that_lands_is_not_made_to_return() -> None:
    gcs = northwards([], GF_ACTION=3, GF_MAX_HOR_DIST=BORDER_M)
    gcs.set_mode(Mode.LAND)
    gcs.vehicle.params.set("GF_MAX_HOR_DIST", 5.0)
    gcs.fly(6.0)
    assert breached(gcs)
    assert mode(gcs) is Mode.LAND


@pytest.mark.parametrize("airframe", ["quad", "plane"])
def test_4_stops_the_motors_until_a_reboot_whatever_is_commanded(airframe: str) -> None:
    gcs = breaching(INCLUSION, airframe, GF_ACTION=4)
    gcs.fly(1.1)
    beat = gcs.last("HEARTBEAT")  # with the mode that was intended (v1.19, flown)
    assert (beat.custom_mode, beat.system_status, beat.base_mode & 128) == (Mode.LOITER, 8, 128)
    assert gcs.vehicle.state.body.v_up_m_s < -5.0
    assert gcs.set_mode(Mode.RTL) == [Result.TEMPORARILY_REJECTED]
    assert "Switching to Return is currently not available" in gcs.texts()
    assert mode(gcs) is Mode.TERMINATION
    gcs.until(lambda: not gcs.armed, 20.0)
    assert mode(gcs) is Mode.TERMINATION
    assert gcs.last("EXTENDED_SYS_STATE").landed_state == LandedState.ON_GROUND
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    gcs.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 1)
    gcs.fly(6.0)
    gcs.arm()


# who can take over ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("action", [2, 3])
def test_a_user_who_changes_the_mode_has_taken_over(action: int) -> None:
    gcs = breaching(INCLUSION, GF_ACTION=action)
    gcs.fly(1.0)
    assert gcs.set_mode(Mode.LAND) == [Result.ACCEPTED]
    gcs.fly(8.0)
    assert (mode(gcs), gcs.vehicle.state.status.failsafe) == (Mode.LAND, False)
    assert gcs.last("HEARTBEAT").system_status == 5, "taken over outside the fence, the failsafe is a warning"


def test_inside_again_the_warning_is_over() -> None:
    gcs = breaching(INCLUSION, GF_ACTION=3)
    assert gcs.set_mode(Mode.RTL) == [Result.ACCEPTED]
    gcs.fly(1.1)
    assert gcs.last("HEARTBEAT").system_status == 5
    gcs.until(lambda: not breached(gcs), 60.0)
    gcs.fly(1.1)
    assert gcs.last("HEARTBEAT").system_status == 4


def test_the_next_breach_acts_again() -> None:
    gcs = breaching(INCLUSION)
    gcs.fly(1.0)
    send_north(gcs, north_m=0.0)
    gcs.until(lambda: not breached(gcs), 20.0)
    send_north(gcs)
    gcs.until(lambda: gcs.vehicle.state.status.failsafe, 40.0)
    assert gcs.texts().count("Failsafe activated") == 2


def test_a_hold_over_the_border_is_one_breach_however_often_it_drifts_across() -> None:
    gcs = breaching(INCLUSION)
    body = gcs.vehicle.state.body
    for north_m in (BORDER_M - 1.0, BORDER_M + 1.0, BORDER_M - 1.0, BORDER_M + 1.0):
        body.north_m = north_m
        gcs.fly(0.5)
    assert gcs.texts().count("Failsafe activated") == 1


def test_a_return_goes_on_when_the_vehicle_is_inside_again() -> None:
    gcs = breaching(INCLUSION, GF_ACTION=3)
    gcs.until(lambda: gcs.vehicle.state.body.north_m < 20.0, 60.0)
    assert (breached(gcs), mode(gcs)) == (False, Mode.RTL)


def test_a_failsafe_that_asks_for_less_does_not_end_it() -> None:
    """The worst of all failsafes is flown."""
    gcs = breaching(INCLUSION, GF_ACTION=3, COM_FAIL_ACT_T=0.0)
    gcs.vehicle.commander.force_mode(Mode.LOITER)
    gcs.fly(0.1)
    assert mode(gcs) is Mode.RTL
    gcs.vehicle.commander.force_mode(Mode.LAND)
    gcs.fly(0.1)
    assert mode(gcs) is Mode.LAND
    gcs.vehicle.commander.resume(Mode.OFFBOARD)
    gcs.fly(0.1)
    assert mode(gcs) is Mode.RTL
