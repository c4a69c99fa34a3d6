"""What the firmware profiles differ in, one promise each. Recorded is px4-main; the older ones follow documents."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.firmware import PROFILES
from app.simulator.wire import Cmd, MissionAck, Result
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, Plan, do, land, takeoff, waypoint

ALL = tuple(PROFILES)
OLD = tuple(name for name in PROFILES if name != "px4-main")
DROP = [takeoff(15), waypoint(60, 0, 15), RELEASE, waypoint(60, 45, 15), RETURN]
DELIVERER = ("PD_GRIPPER_TYPE", "PD_GRIPPER_TO")
NPFG, L1 = ("NPFG_PERIOD", "NPFG_DAMPING", "NPFG_SW_DST_MLT"), ("FW_L1_PERIOD", "FW_L1_DAMPING")
LANDING = [Plan(Cmd.NAV_LOITER_TO_ALT, 80, 300, 20, (1, 60, 0, 1)), land()]


@pytest.mark.parametrize(
    ("firmware", "version"),
    [("px4-main", (1, 19, 0, 64)), ("px4-1.14", (1, 14, 3, 255)), ("px4-1.13", (1, 13, 3, 255))],
)
def test_autopilot_version_names_it(firmware: str, version: tuple[int, ...]) -> None:
    gcs = GroundStation(ready=False, firmware=firmware)
    gcs.command(Cmd.REQUEST_MESSAGE, 148)
    message = gcs.last("AUTOPILOT_VERSION")
    assert tuple(message.flight_sw_version.to_bytes(4, "big")) == version
    assert any(message.flight_custom_version)


# payload items ----------------------------------------------------------------------------------------------


def test_only_older_firmware_brakes_at_the_waypoint_before_a_gripper_item() -> None:
    speeds = {}
    for firmware in ("px4-main", "px4-1.14"):
        gcs = GroundStation(firmware=firmware)
        gcs.start([DROP[0], waypoint(60, 0, 15, radius_m=3.0), RELEASE, waypoint(120, 0, 15)])  # straight on
        gcs.until(lambda: gcs.vehicle.state.gripper.output_released)  # noqa: B023
        speeds[firmware] = gcs.vehicle.state.body.ground_speed_m_s
    assert speeds["px4-main"] > 4.0
    assert speeds["px4-1.14"] < 3.0


@pytest.mark.parametrize(
    ("firmware", "params", "waits_s"),
    [
        ("px4-main", {"PD_GRIPPER_TO": 2.0}, 0.0),
        ("px4-main", {"PD_GRIPPER_TO": 2.0, "MIS_COMMAND_TOUT": 4.0}, 4.0),
        ("px4-1.14", {"PD_GRIPPER_TO": 2.0}, 2.0),
        ("px4-1.14", {"PD_GRIPPER_TO": 8.0, "MIS_PD_TO": 3.0}, 3.0),
        ("px4-1.14", {"PD_GRIPPER_TYPE": -1, "MIS_PD_TO": 3.0}, 3.0),  # FAILED is no delivery
        ("px4-1.14", {"PD_GRIPPER_EN": 0, "MIS_PD_TO": 3.0}, 3.0),
    ],
)
def test_how_long_a_mission_stays_at_its_gripper_item(firmware: str, params: dict[str, float], waits_s: float) -> None:
    gcs = GroundStation(firmware=firmware, params=params)
    gcs.start(DROP)
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 3) == pytest.approx(waits_s, abs=0.1)


def test_an_ack_counts_for_its_own_item_alone() -> None:
    """The release's is no answer to the winch item behind it, which nobody answers."""
    gcs = GroundStation(firmware="px4-1.14", params={"MIS_PD_TO": 4.0, "NAV_ACC_RAD": 2.0})
    gcs.start([takeoff(5), waypoint(10, 0, 5), RELEASE, do(Cmd.DO_WINCH, 1, 4), waypoint(10, 45, 5)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 3)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 4) == pytest.approx(4.0, abs=0.1)


def test_px4_1_14_goes_on_at_once_when_the_gripper_is_open_already() -> None:
    gcs = GroundStation(firmware="px4-1.14")
    gcs.command(Cmd.DO_GRIPPER, 1, 0, wait_s=2.0)
    gcs.start(DROP)
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 3) < 0.1


@pytest.mark.parametrize(("winch", "waits_s"), [(True, 9.0), (False, 20.0)])
def test_px4_1_14_waits_for_a_winch_too_in_vain_if_there_is_none(winch: bool, waits_s: float) -> None:
    gcs = GroundStation(firmware="px4-1.14", winch=winch, params={"MIS_PD_TO": 20.0, "NAV_ACC_RAD": 2.0})
    gcs.start([takeoff(8), waypoint(15, 0, 8), do(Cmd.DO_WINCH, 1, 4), waypoint(15, 30, 8)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 3) == pytest.approx(waits_s, abs=1.0)


def test_px4_1_13_has_no_payload_deliverer() -> None:
    gcs = GroundStation(firmware="px4-1.13")
    assert gcs.messages("COMMAND_LONG") == []
    for command in (Cmd.DO_GRIPPER, Cmd.DO_WINCH):
        assert gcs.upload([takeoff(15), do(command, 1, 0)]) == MissionAck.UNSUPPORTED
        assert gcs.command(command, 1, 0) == [Result.UNSUPPORTED]


# guidance ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("firmware", "seconds"), [("px4-main", 2.24), ("px4-1.14", 2.24), ("px4-1.13", 4.77)])
def test_a_fixed_wing_reaches_its_waypoints_by_the_switch_distance_of_its_guidance(
    firmware: str, seconds: float
) -> None:
    gcs = GroundStation("plane", firmware=firmware)
    gcs.start([takeoff(40, 160, 15), waypoint(600, 0, 40), waypoint(600, 300, 40), *LANDING])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2, 120.0)
    speed = gcs.vehicle.state.body.ground_speed_m_s
    assert gcs.distance_to(600, 0) == pytest.approx(seconds * speed, rel=0.03)


@pytest.mark.parametrize(
    ("firmware", "changed"), [("px4-main", {"NPFG_SW_DST_MLT": 1.0}), ("px4-1.13", {"FW_L1_PERIOD": 30.0})]
)
def test_the_switch_distance_follows_the_guidance_parameters(firmware: str, changed: dict[str, float]) -> None:
    gcs = GroundStation("plane", firmware=firmware, params=changed)
    gcs.start([takeoff(40, 160, 15), waypoint(600, 0, 40), waypoint(600, 300, 40), *LANDING])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2, 120.0)
    seconds = gcs.distance_to(600, 0) / gcs.vehicle.state.body.ground_speed_m_s
    assert seconds == pytest.approx({"px4-main": 7.0, "px4-1.13": 7.16}[firmware], rel=0.03)


# the wire ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", OLD)
def test_older_firmware_knows_no_mission_ids_states_and_masks(firmware: str) -> None:
    gcs = GroundStation(firmware=firmware)
    assert gcs.upload([takeoff(15), Plan(16, 10, 0, 15, (0, 0, 7, 0))]) == MissionAck.ACCEPTED
    assert gcs.last("MISSION_ACK").opaque_id == 0
    gcs.fly(1.1)
    current = gcs.last("MISSION_CURRENT")
    assert (current.total, current.mission_id, current.mission_state, current.mission_mode) == (2, 0, 0, 0)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert gcs.last("MISSION_COUNT").opaque_id == 0


@pytest.mark.parametrize(("firmware", "result"), [("px4-main", 0), *((name, Result.FAILED) for name in OLD)])
def test_only_px4_main_reports_the_intended_mode(firmware: str, result: int) -> None:
    """CURRENT_MODE comes since v1.15."""
    gcs = GroundStation(firmware=firmware)
    gcs.fly(3.0)
    assert gcs.command(Cmd.SET_MESSAGE_INTERVAL, 436, 200_000) == [result]
    assert gcs.command(Cmd.REQUEST_MESSAGE, 436) == [Result.DENIED if result else Result.ACCEPTED]
    gcs.fly(1.0)
    assert bool(gcs.messages("CURRENT_MODE")) is (result == 0)


@pytest.mark.parametrize("firmware", ALL)
def test_only_px4_main_answers_a_parameter_that_does_not_exist(firmware: str) -> None:
    gcs = GroundStation(firmware=firmware)
    gcs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"NO_SUCH_PARAM", -1))
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"NO_SUCH_PARAM", 1.0, 9))
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", 5.0, 9))
    assert len(gcs.messages("PARAM_ERROR")) == (3 if firmware == "px4-main" else 0)
    assert gcs.vehicle.params["COM_OBL_RC_ACT"] == 0


@pytest.mark.parametrize(
    ("firmware", "has", "has_not"),
    [
        ("px4-main", {"MIS_COMMAND_TOUT", *DELIVERER, *NPFG}, {"MIS_PD_TO", "PD_GRIPPER_EN", *L1}),
        ("px4-1.14", {"MIS_PD_TO", "PD_GRIPPER_EN", *DELIVERER, *NPFG}, {"MIS_COMMAND_TOUT", *L1}),
        ("px4-1.13", {*L1}, {"MIS_COMMAND_TOUT", "MIS_PD_TO", "PD_GRIPPER_EN", *DELIVERER, *NPFG}),
    ],
)
def test_each_has_its_own_parameters(firmware: str, has: set[str], has_not: set[str]) -> None:
    params = GroundStation(firmware=firmware, ready=False).vehicle.params
    assert {name for name in has | has_not if name in params} == has
