"""Where each vehicle type lets go: the release points of scenarios 06, 07, 10, 11, 12, 13 and of the facts behind them.

Tolerance: 2 m or 15 %, as the fidelity goal says.
"""

from __future__ import annotations

import pytest

from app.simulator.wire import Cmd, VtolState
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, Plan, do, land, takeoff, waypoint

LOITER_DOWN = Plan(Cmd.NAV_LOITER_TO_ALT, 80, 300, 20, (1, 60, 0, 1))


def release(gcs: GroundStation, north_m: float, east_m: float, timeout_s: float = 150.0) -> tuple[float, float]:
    """Distance from the drop point, and ground speed, when the output moves."""
    gcs.until(lambda: gcs.vehicle.state.gripper.output_released, timeout_s)
    return gcs.distance_to(north_m, east_m), gcs.vehicle.state.body.ground_speed_m_s


def quad(hold_s: float = 0.0, radius_m: float = 0.0, **options: object) -> GroundStation:
    gcs = GroundStation(**options)  # type: ignore[arg-type]
    gcs.start([takeoff(15), waypoint(60, 0, 15, hold_s, radius_m), RELEASE, waypoint(60, 45, 15), RETURN])
    return gcs


@pytest.mark.parametrize(
    ("hold_s", "radius_m", "distance_m", "speed_m_s"),
    [(0.0, 0.0, 9.9, 4.7), (3.0, 0.0, 0.9, 1.5), (0.0, 1.0, 0.9, 1.6), (5.0, 1.0, 0.8, 0.2)],
)
def test_a_multicopter_stops_only_with_a_hold_and_a_radius(
    hold_s: float, radius_m: float, distance_m: float, speed_m_s: float
) -> None:
    distance, speed = release(quad(hold_s, radius_m), 60, 0)
    assert distance == pytest.approx(distance_m, abs=2.0)
    assert speed == pytest.approx(speed_m_s, abs=0.5)


def test_px4_1_14_brakes_at_the_gripper_and_waits_for_its_ack() -> None:
    gcs = quad(radius_m=1.0, firmware="px4-1.14")
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    begin_s = gcs.now_s
    gcs.until(lambda: gcs.vehicle.store.current_seq == 3)
    assert gcs.now_s - begin_s == pytest.approx(1.0, abs=0.1), "PD_GRIPPER_TO"
    assert gcs.distance_to(60, 0) < 2.0
    assert gcs.vehicle.state.body.ground_speed_m_s < 1.0


def test_px4_1_14_gives_up_waiting_after_mis_pd_to() -> None:
    gcs = quad(firmware="px4-1.14", params={"MIS_PD_TO": 3.0})
    gcs.vehicle.faults.slow_gripper_s = 60.0
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 3) == pytest.approx(3.0, abs=0.1)


def test_mis_command_tout_waits_its_full_time_even_when_the_gripper_is_done_sooner() -> None:
    gcs = quad(1.0, 1.0, params={"MIS_COMMAND_TOUT": 5.0, "PD_GRIPPER_TO": 2.0})
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 3) == pytest.approx(5.0, abs=0.1)


def test_a_plane_releases_its_switch_distance_before_the_waypoint() -> None:
    gcs = GroundStation("plane")
    gcs.start([takeoff(40, 160, 15), waypoint(400, 0, 40), RELEASE, waypoint(400, 300, 40),
                   do(Cmd.DO_LAND_START), LOITER_DOWN, land()])  # fmt: skip
    distance, speed = release(gcs, 400, 0)
    assert speed == pytest.approx(11.8, abs=0.5)
    assert distance == pytest.approx(25.7, rel=0.15)
    assert distance == pytest.approx(2.24 * speed, rel=0.06)
    gcs.until(lambda: not gcs.armed)
    assert gcs.texts()[-2:] == ["Mission finished, landed", "Disarmed by landing"]
    assert gcs.distance_to(0, 0) < 40.0


def test_wind_moves_a_planes_release_with_its_ground_speed() -> None:
    gcs = GroundStation("plane")
    gcs.vehicle.faults.wind_north_m_s = 4.0
    gcs.start([takeoff(40, 160, 15), waypoint(500, 0, 40), RELEASE, LOITER_DOWN, land()])
    distance, speed = release(gcs, 500, 0)
    assert speed == pytest.approx(15.9, abs=0.7)
    assert distance == pytest.approx(2.24 * speed, rel=0.06)


def test_a_plane_after_a_loiter_releases_on_the_circle() -> None:
    gcs = GroundStation("plane")
    gcs.start([takeoff(40, 160, 15), Plan(Cmd.NAV_LOITER_TIME, 400, 0, 40, (20, 0, 60, 0)), RELEASE,
                   do(Cmd.NAV_DELAY, 2, -1, -1, -1), waypoint(400, 300, 40), LOITER_DOWN, land()])  # fmt: skip
    gcs.until(lambda: gcs.vehicle.store.current_seq == 1)
    begin_s = gcs.now_s
    distance, _ = release(gcs, 400, 0)
    assert distance == pytest.approx(60.0, rel=0.15)
    assert gcs.now_s - begin_s == pytest.approx(39.0, rel=0.2)


def test_a_vtol_stops_after_its_transition_and_flies_on_as_a_plane() -> None:
    gcs = GroundStation("vtol")
    gcs.start([
        takeoff(30, 60, command=Cmd.NAV_VTOL_TAKEOFF), waypoint(250, 0, 30), do(Cmd.DO_VTOL_TRANSITION, 3),
        waypoint(400, 0, 30, 5, 2), RELEASE, do(Cmd.NAV_DELAY, 2, -1, -1, -1), do(Cmd.DO_VTOL_TRANSITION, 4),
        waypoint(400, 250, 30), land(command=Cmd.NAV_VTOL_LAND),
    ])  # fmt: skip
    distance, speed = release(gcs, 400, 0)
    assert distance < 2.0
    assert speed < 0.5
    gcs.until(lambda: not gcs.armed)
    states = [state for (state,) in gcs.changes("EXTENDED_SYS_STATE", "vtol_state")]
    mc, fw = VtolState.MC, VtolState.FW
    to_fw, to_mc = VtolState.TRANSITION_TO_FW, VtolState.TRANSITION_TO_MC
    assert states == [mc, to_fw, fw, to_mc, mc, to_fw, fw, to_mc, mc]
    assert gcs.distance_to(0, 0) < 2.0


def test_a_vtol_in_fixed_wing_flight_releases_like_a_plane() -> None:
    gcs = GroundStation("vtol")
    gcs.start([takeoff(30, 60, command=Cmd.NAV_VTOL_TAKEOFF), waypoint(300, 0, 30, 5, 1), RELEASE,
                   waypoint(400, 250, 30), land(command=Cmd.NAV_VTOL_LAND)])  # fmt: skip
    distance, speed = release(gcs, 300, 0)
    assert distance == pytest.approx(22.6, abs=3.0)
    assert speed == pytest.approx(10.3, abs=0.5)


def test_a_rover_stops_only_for_a_delay() -> None:
    gcs = GroundStation("rover")
    gcs.start([waypoint(30, 0, 0, 5), RELEASE, waypoint(30, 25, 0)])
    distance, speed = release(gcs, 30, 0)
    assert distance == pytest.approx(1.2, abs=0.3)
    assert speed == pytest.approx(2.1, abs=0.4)
    waiting = GroundStation("rover")
    waiting.start([waypoint(30, 0, 0), do(Cmd.NAV_DELAY, 5, -1, -1, -1), RELEASE, waypoint(30, 25, 0)])
    distance, speed = release(waiting, 30, 0)
    assert distance < 0.3
    assert speed < 0.3
    waiting.until(lambda: waiting.vehicle.mission.result.finished)
    waiting.fly(20.0)
    assert waiting.armed
    assert waiting.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196) == [0]


def test_an_airship_passes_over_and_cannot_stop() -> None:
    gcs = GroundStation("airship")
    gcs.start([takeoff(20), waypoint(80, 0, 20, 10, 1), RELEASE, waypoint(80, 60, 20), RETURN])
    distance, speed = release(gcs, 80, 0)
    assert distance == pytest.approx(10.0, abs=2.0)
    assert speed > 2.0


def test_a_plane_that_comes_too_high_counts_the_waypoint_when_the_height_fits() -> None:
    """[flown] release far behind the waypoint."""
    gcs = GroundStation("plane")
    gcs.start([takeoff(100, 160, 15), waypoint(260, 0, 20), RELEASE, LOITER_DOWN, land()])
    distance, _ = release(gcs, 260, 0)
    assert distance > 60.0
    assert gcs.vehicle.state.body.up_m < 31.0
