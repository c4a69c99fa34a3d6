"""EVENT: ids from names, and that each reason for a refused mission is sent."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from app.simulator.events import EVENTS, event_id
from app.simulator.mission import feasibility
from tests.support.simulated_vehicle import RETURN, GroundStation, Plan, land, takeoff, waypoint

RECORDED = {
    "commander_arm_denied_resolve_failures": 16910493,
    "commander_armed_by": 26266355,
    "commander_disarmed_by": 32794487,
    "commander_dl_regained": 31011876,
    "commander_failsafe_enter_generic": 31382480,
    "commander_failsafe_enter_hold": 30481910,
    "commander_gcs_lost": 27571288,
    "commander_landing_current_pos": 20099806,
    "commander_landing_detected": 26622124,
    "commander_mission_start_denied_no_mission": 23844490,
    "commander_modeswitch_not_avail": 27280279,
    "commander_rtl": 20262116,
    "commander_takeoff_detected": 21054825,
    "commander_unsupported_auto_mode": 19869445,
    "mavlink_rcv_sp_target_gl_invalid_coord": 27739955,
    "mavlink_rcv_sp_target_invalid": 22427557,
    "mission_climb_before_start": 24986204,
    "mission_execute": 32375217,
    "mission_finished": 24580612,
    "mission_finished_loiter": 21455606,
    "mission_not_valid_loiter": 20167372,
    "navigator_geofence_invalid_against_home": 27750677,
    "navigator_mis_add_land_or_rm_to": 19546926,
    "navigator_mis_first_wp_far": 22091529,
    "navigator_mis_geofence_violation": 19608877,
    "navigator_mis_glide_slope_too_steep": 21551397,
    "navigator_mis_land_missing": 25237137,
    "navigator_mis_takeoff_not_first": 33440290,
    "navigator_route_cache_too_large": 25737816,
    "navigator_takeoff_default_alt": 20656071,
    "rtl_destination_breaches": 22524574,
    "rtl_land_at_destination": 16962474,
    "vrtl_return_at": 22161044,
}
SOURCES = Path(feasibility.__file__).parents[1]


@pytest.mark.parametrize(("name", "number"), RECORDED.items())
def test_an_id_is_the_hash_of_its_name_as_recorded(name: str, number: int) -> None:
    assert event_id(name) == number


def reasons() -> set[str]:
    """Names of events that the feasibility check gives."""
    tree = ast.parse(Path(feasibility.__file__).read_text(encoding="utf-8"))
    strings = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    return {text for text in strings if text.startswith("navigator_mis_")}


def emitted() -> set[str]:
    """Names given to `event(...)` or `_event(...)` anywhere in the simulator."""
    names = set()
    for path in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr.endswith("event"):
                names |= {
                    one.value for one in node.args if isinstance(one, ast.Constant) and isinstance(one.value, str)
                }
    return names


def test_each_event_that_is_emitted_exists() -> None:
    assert len(reasons()) > 15
    assert len(emitted()) > 15
    assert (reasons() | emitted()) - set(EVENTS) == set()


@pytest.mark.parametrize(
    ("airframe", "plans", "name"),
    [
        ("quad", [takeoff(0), waypoint(5, 0, 5), RETURN], "navigator_mis_takeoff_too_low"),
        ("quad", [land(), takeoff(5)], "navigator_mis_starts_w_landing"),
        ("quad", [takeoff(5), Plan(85, 5)], "navigator_mis_unsup_cmd"),
        ("plane", [waypoint(500, 0, 0), land(900)], "navigator_mis_approach_wp_below_land"),
        ("plane", [waypoint(850, 0, 50), land(900)], "navigator_mis_glide_slope_too_steep"),
    ],
)
def test_the_reason_of_a_refused_mission_is_sent(airframe: str, plans: list[Plan], name: str) -> None:
    gcs = GroundStation(airframe)
    assert gcs.upload(plans) == 0
    gcs.fly(0.1)
    assert event_id(name) in [event.id for event in gcs.messages("EVENT")]


def test_its_arguments_are_packed_as_the_source_says() -> None:
    gcs = GroundStation()
    gcs.upload([takeoff(5), Plan(85, 5)])
    gcs.fly(0.1)
    sent = next(m for m in gcs.messages("EVENT") if m.id == event_id("navigator_mis_unsup_cmd"))
    assert list(sent.arguments[:4]) == [2, 0, 85, 0], "item 2, command 85"
