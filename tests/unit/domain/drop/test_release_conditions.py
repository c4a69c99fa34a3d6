"""What must be true of the vehicle, besides its place, before a release is sent."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.record import Certainty, DropOutcome
from app.domain.drop.supervised_inputs import DropTerms
from app.domain.flight.snapshot import VehicleSnapshot, height_error_m
from app.domain.mission import CompiledDrop
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import GnssFix, VehicleState
from tests.support.plan_pieces import at, gripper, land, multicopter, rover, waypoint
from tests.support.supervised_flight import TERMS, Flight


@pytest.mark.parametrize("fix", [GnssFix.NO_GPS, GnssFix.NO_FIX, GnssFix.FIX_2D])
def test_nothing_is_released_without_a_gnss_fix(fix: GnssFix) -> None:
    flight = Flight(gnss_fix=fix)
    flight.tick(TERMS.hold_s + 30.0)
    assert flight.sends_s == []
    assert flight.finish is not None
    assert (flight.finish.outcome, flight.finish.certainty) == (DropOutcome.KEPT, Certainty.INFERRED)
    assert flight.finish.reason == Reason.of(ReasonCode.NO_GNSS)


def test_a_fix_that_is_back_in_the_hold_allows_the_release() -> None:
    flight = Flight(gnss_fix=GnssFix.NO_GPS)
    flight.tick(10.0)
    flight.gnss_fix = GnssFix.FIX_3D
    flight.until_sent()


@pytest.mark.parametrize("fix", [None, GnssFix.FIX_3D, GnssFix.RTK_FIXED])
def test_a_fix_that_is_good_or_not_reported_prevents_nothing(fix: GnssFix | None) -> None:
    Flight(gnss_fix=fix).until_sent()


def test_a_fix_that_is_lost_between_two_attempts_prevents_the_second() -> None:
    flight = Flight()
    flight.until_sent()
    flight.gnss_fix = GnssFix.NO_GPS
    flight.time_out()
    flight.tick(5.0)
    assert len(flight.sends_s) == 1


HOVERS = replace(TERMS, max_height_error_m=3.0)


@pytest.mark.parametrize("error_m", [15.0, 3.1, None])
def test_nothing_is_released_far_above_or_below_where_the_vehicle_is_to_hover(error_m: float | None) -> None:
    flight = Flight(HOVERS, height_error_m=error_m)
    flight.tick(HOVERS.hold_s + 30.0)
    assert flight.sends_s == []
    assert flight.finish is not None
    assert flight.finish.outcome is DropOutcome.KEPT
    assert flight.finish.reason == Reason.of(ReasonCode.WRONG_HEIGHT, max_height_error_m=3.0)


def test_a_height_that_becomes_right_in_the_hold_allows_the_release() -> None:
    flight = Flight(HOVERS, height_error_m=5.0)
    flight.tick(5.0)
    flight.height_error_m = 0.4
    flight.until_sent()


def drop_of(plan: Plan) -> CompiledDrop:
    return compile_plan(plan, default_facts(plan.vehicle_type)).drops[0]


SUPERVISED = gripper(mode="supervised")
ABSOLUTE = {**waypoint(), "relative_altitude_m": None, "absolute_altitude_m": 520.0}
IS_AT = VehicleState(relative_altitude_m=31.5, absolute_altitude_m=519.0)


@pytest.mark.parametrize(
    ("plan", "error_m"),
    [
        (multicopter(waypoint(altitude_m=30), SUPERVISED), 1.5),
        (multicopter(ABSOLUTE, SUPERVISED), 1.0),
        (multicopter(waypoint(), land(100), SUPERVISED, waypoint()), None),
        (rover(waypoint(altitude_m=0), SUPERVISED), None),
    ],
    ids=["above home", "AMSL", "landed", "on wheels"],
)
def test_the_height_is_compared_in_the_frame_of_the_plan_and_only_where_the_vehicle_hovers(
    plan: Plan, error_m: float | None
) -> None:
    assert height_error_m(VehicleSnapshot(IS_AT, 0.0, 0.0, 1.0), drop_of(plan)) == error_m
    assert (DropTerms.of(drop_of(plan), 2.0).max_height_error_m is None) == (error_m is None)


def test_an_alternate_has_a_height_of_its_own() -> None:
    there = at(0, 120, relative_altitude_m=20, id="locker", hold_s=20)
    alternate = drop_of(multicopter(waypoint(altitude_m=30), gripper(mode="supervised", alternate=there))).alternate
    assert alternate is not None
    assert height_error_m(VehicleSnapshot(IS_AT, 0.0, 0.0, 1.0), alternate) == 11.5
