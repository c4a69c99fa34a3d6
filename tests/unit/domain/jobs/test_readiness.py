"""What speaks against a vehicle: each thing by itself, and whatever is not known."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.jobs.assignment import (
    VehicleReadiness,
    beginning_of,
    distance_to,
    why_not_ready,
    why_not_selected,
    why_unfit,
)
from app.domain.jobs.job import VehicleSelector
from app.domain.plan import parse_plan
from app.domain.reasons import Reason, ReasonCode
from app.domain.validation.finding import Finding, Severity
from app.domain.vehicle.state import LandedState, VehicleState
from tests.support.job_examples import READY
from tests.support.job_plans import ROUTE


def sight(**changes: object) -> VehicleReadiness:
    return replace(VehicleReadiness("v1", READY), **changes)  # type: ignore[arg-type]


def state(**changes: object) -> VehicleState:
    return replace(READY, **changes)  # type: ignore[arg-type]


def test_nothing_speaks_against_a_vehicle_that_stands_there_free() -> None:
    assert why_not_ready(sight()) == ()


@pytest.mark.parametrize(
    ("seen", "code"),
    [
        (sight(quarantined=Reason.of(ReasonCode.TWO_CLOCKS)), "vehicle.quarantined"),
        (sight(state=state(connected=False)), "vehicle.disconnected"),
        (sight(held_by="run r"), "vehicle.busy"),
        (sight(lease_holder="a pilot"), "vehicle.leased"),
        (sight(state=state(armed=True)), "vehicle.armed"),
        (sight(state=state(armed=None)), "vehicle.armed"),
        *((sight(state=state(landed=one)), "vehicle.not_landed") for one in LandedState if one != "on_ground"),
        (sight(state=state(in_failsafe=True)), "vehicle.in_failsafe"),
        (sight(stopped="run r failed"), "vehicle.queue_stopped"),
    ],
)
def test_each_thing_speaks_against_it(seen: VehicleReadiness, code: str) -> None:
    (refusal,) = why_not_ready(seen)
    assert (refusal.code, refusal.pointer) == (code, None)
    assert refusal.hint, "a dispatcher must know what to do"


def test_all_reasons_are_told_at_once() -> None:
    seen = sight(held_by="run r", stopped="x", state=state(armed=True, landed=LandedState.IN_AIR))
    codes = [refusal.code for refusal in why_not_ready(seen)]
    assert codes == ["vehicle.busy", "vehicle.armed", "vehicle.not_landed", "vehicle.queue_stopped"]


@pytest.mark.parametrize(
    ("selector", "battery", "code"),
    [
        (VehicleSelector(vehicle="any"), None, None),
        (VehicleSelector(vehicle="v1"), 80.0, None),
        (VehicleSelector(vehicle="v2"), 80.0, "vehicle.not_allowed"),
        (VehicleSelector(vehicle="any", allowed_vehicles=("v2",)), 80.0, "vehicle.not_allowed"),
        (VehicleSelector(vehicle="any", allowed_vehicles=("v2", "v1")), 80.0, None),
        (VehicleSelector(vehicle="any", min_battery_percent=80.0), 80.0, None),
        (VehicleSelector(vehicle="any", min_battery_percent=80.0), 79.9, "vehicle.battery_low"),
        (VehicleSelector(vehicle="any", min_battery_percent=1.0), None, "vehicle.battery_unknown"),
    ],
)
def test_what_the_job_asks_for(selector: VehicleSelector, battery: float | None, code: str | None) -> None:
    assert [refusal.code for refusal in why_not_selected("v1", battery, selector)] == ([] if code is None else [code])


def test_a_warning_that_nobody_would_read_refuses_where_waydrop_chooses() -> None:
    found = [
        Finding(code="vehicle.home_differs", severity=Severity.WARNING, pointer="/home", message="150 m away"),
        Finding(code="drop.command_timeout", severity=Severity.WARNING, pointer="/items/1", message="waits"),
        Finding(code="gripper.none", severity=Severity.ERROR, pointer="/items/2", message="has none"),
    ]
    assert [refusal.code for refusal in why_unfit(found, we_choose=False)] == ["gripper.none"]
    assert [refusal.code for refusal in why_unfit(found, we_choose=True)] == ["vehicle.home_differs", "gripper.none"]


def test_the_distance_is_to_where_the_plan_begins() -> None:
    away = state(latitude_deg=47.398742, longitude_deg=8.545594)
    assert distance_to(beginning_of(parse_plan(ROUTE)), away) == pytest.approx(111.2, abs=0.5)
    without_home = {key: value for key, value in ROUTE.items() if key != "home"}
    assert beginning_of(parse_plan(without_home)) == (47.398282, 8.545594), "the first place that it names"
    assert distance_to(beginning_of(parse_plan(ROUTE)), READY) is None
