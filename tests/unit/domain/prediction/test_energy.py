"""What a flight takes from the battery: by phase, by the declared rates, and in wind."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from app.domain.autopilot.declared import declared_for, require_known_keys
from app.domain.prediction import Timeline, Wind, predict
from app.domain.vehicle.performance import Performance, Phase
from app.domain.vehicle.state import VehicleType
from tests.support.plan_pieces import facts, fixed_wing, gripper, multicopter, rover, vtol, waypoint

WATTS = Performance(battery_capacity_wh=200.0, cruise_w=360.0, hover_w=720.0, climb_w=1080.0)


def timeline(performance: Performance | None, vehicle_type: str = "multicopter", wind: Wind | None = None) -> Timeline:
    flights = {
        "multicopter": multicopter(waypoint(500), gripper()),
        "fixed_wing": fixed_wing(waypoint(500)),
        "vtol": vtol(waypoint(500)),
        "rover": rover(waypoint(50, 0, 0)),
    }
    own = replace(facts(vehicle_type), performance=performance)
    return predict(flights[vehicle_type], own, wind or Wind())


def test_without_a_declared_rate_nothing_is_said() -> None:
    for performance in (None, Performance(payload_max_kg=2.0)):
        silent = timeline(performance)
        assert silent.battery_used_percent is None
        assert {entry.battery_used_percent for entry in silent.entries} == {None}
        assert {drop.return_battery_percent for drop in silent.drops} == {None}


@pytest.mark.parametrize("vehicle_type", ["multicopter", "fixed_wing", "vtol", "rover"])
def test_one_rate_for_all_is_time_alone(vehicle_type: str) -> None:
    flown = timeline(Performance(battery_percent_per_min=6.0), vehicle_type)
    assert flown.battery_used_percent == pytest.approx(flown.duration_s / 10.0)
    for entry in flown.entries:
        assert entry.battery_used_percent == pytest.approx(entry.duration_s / 10.0)
        assert entry.energy_wh is None


def test_watts_go_by_what_the_vehicle_does() -> None:
    climbs, cruises, hovers, _ = timeline(WATTS).entries
    assert climbs.energy_wh == pytest.approx(climbs.duration_s * 1080 / 3600, rel=0.1)
    assert cruises.energy_wh == pytest.approx(cruises.duration_s * 360 / 3600, rel=0.25)
    assert hovers.energy_wh == pytest.approx(hovers.duration_s * 720 / 3600)
    assert hovers.battery_used_percent == pytest.approx(100.0 * (hovers.energy_wh or 0.0) / 200.0)


def test_a_wing_takes_more_against_the_wind_there_and_less_on_the_way_back() -> None:
    calm, against = timeline(WATTS, "fixed_wing").entries[1], timeline(WATTS, "fixed_wing", Wind(-8.0)).entries[1]
    assert (against.energy_wh or 0.0) > 1.3 * (calm.energy_wh or 0.0)


def test_a_return_from_a_drop_takes_what_the_return_of_the_plan_takes() -> None:
    flown = timeline(WATTS)
    assert flown.drops[0].return_battery_percent == pytest.approx(flown.entries[-1].battery_used_percent, rel=0.01)


@given(st.floats(50, 2000), st.floats(50, 2000), st.floats(50, 2000), st.floats(10, 5000))
def test_energy_lies_between_all_at_the_lowest_and_all_at_the_highest_rate(
    cruise_w: float, hover_w: float, climb_w: float, capacity_wh: float
) -> None:
    own = Performance(battery_capacity_wh=capacity_wh, cruise_w=cruise_w, hover_w=hover_w, climb_w=climb_w)
    flown = timeline(own)
    hours, rates = flown.duration_s / 3600.0, (cruise_w, hover_w, climb_w)
    energy_wh = sum(entry.energy_wh or 0.0 for entry in flown.entries)
    assert min(rates) * hours <= energy_wh * 1.000001
    assert energy_wh <= max(rates) * hours * 1.000001


def test_a_rate_that_is_not_given_is_the_highest_that_is() -> None:
    own = Performance(battery_capacity_wh=100.0, cruise_w=300.0, hover_w=500.0)
    assert own.percent_per_s(Phase.CLIMB) == own.percent_per_s(Phase.HOVER) > own.percent_per_s(Phase.CRUISE)


@pytest.mark.parametrize(
    "wrong",
    [
        {"hover_w": 300.0, "battery_capacity_wh": 100.0},
        {"cruise_w": 300.0},
        {"cruise_w": 300.0, "battery_capacity_wh": 100.0, "battery_percent_per_min": 4.0},
        {"reserve_percent": 100.0},
        {"payload_max_kg": -1.0},
        {"payload_kg": 1.0},
    ],
)
def test_half_a_declaration_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        Performance.model_validate(wrong)


def test_the_most_special_declaration_counts() -> None:
    by_uid, by_id, by_type = (Performance(payload_max_kg=kg) for kg in (1.0, 2.0, 3.0))
    declared = {"00aa": by_uid, "v1": by_id, "multicopter": by_type}
    assert declared_for(declared, "v1", "00aa", VehicleType.MULTICOPTER) is by_uid
    assert declared_for(declared, "v1", None, VehicleType.MULTICOPTER) is by_id
    assert declared_for(declared, "v2", "00bb", VehicleType.MULTICOPTER) is by_type
    assert declared_for(declared, "v2", None, VehicleType.ROVER) is None


def test_a_key_that_can_be_no_vehicle_is_refused() -> None:
    require_known_keys({"v12": Performance(), "v1-2": Performance(), "00ff": Performance(), "vtol": Performance()})
    with pytest.raises(ValueError, match="multicoptr"):
        require_known_keys({"multicoptr": Performance()})
