"""Another station moves home in flight: PX4 flies every altitude above home from there (flown)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.flight.snapshot import ReleaseCommand
from app.domain.reasons import ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.state import GlobalPosition, LandedState, VehicleState
from tests.support.flown_flights import Flown
from tests.support.told_flight import Told

HOME = GlobalPosition(47.397742, 8.545594, 488.0)


def at(altitude_m: float) -> GlobalPosition:
    return replace(HOME, altitude_m=altitude_m)


@dataclass
class MovedHome(Flown):
    """On its way home is moved, and it flies on at the altitude of its plan above that."""

    altitudes_m: tuple[float, ...] = (488.0,)

    @property
    def state(self) -> VehicleState:
        second = int(self.now_s - 1001.0)
        altitude_m = self.altitudes_m[max(0, min(second, len(self.altitudes_m) - 1))]
        return replace(super().state, home=at(altitude_m), absolute_altitude_m=altitude_m + 15.0)


@pytest.mark.parametrize("moved_m", [10.0, -12.0])
def test_nothing_is_released_at_another_height_than_the_plans(moved_m: float) -> None:
    flown = MovedHome(altitudes_m=(488.0, 488.0 + moved_m))
    run = flown.to_the_end()
    assert not any(isinstance(one, ReleaseCommand) for one in flown.commands)
    drop = run.drops[0]
    assert drop.outcome is DropOutcome.KEPT
    assert drop.reason is not None
    assert drop.reason.code is ReasonCode.WRONG_HEIGHT


def test_what_px4_corrects_in_small_steps_is_no_other_height() -> None:
    flown = MovedHome(altitudes_m=(488.0, 489.2, 490.5, 492.0, 493.1))
    drop = flown.to_the_end().drops[0]
    assert (drop.outcome, drop.relative_altitude_m) == (DropOutcome.RELEASED, 15.0)


def test_the_run_says_so_until_home_is_back() -> None:
    told = Told()
    told.see(2.0, home=HOME)
    told.see(1.0, home=at(468.0))
    reason = told.run.reason
    assert told.run.state is RunState.FLYING
    assert reason is not None
    assert (reason.code, dict(reason.params)) == (ReasonCode.HOME_MOVED, {"moved_m": 20.0, "direction": "down"})
    told.restart()
    told.see(1.0)
    assert told.run.reason == reason
    told.see(1.0, home=HOME)
    assert told.run.reason is None


def test_the_evidence_is_above_the_home_of_the_takeoff() -> None:
    """Not above the home to which somebody moved it, which says nothing of the ground."""
    told = Told()
    told.see(2.0, home=HOME, relative_altitude_m=15.0)
    told.see(1.0, home=at(498.0), relative_altitude_m=5.0)
    assert told.flight.snapshot(told.observed).relative_altitude_m == pytest.approx(15.0)


def test_what_px4_corrected_before_a_restart_does_not_add_up() -> None:
    told = Told()
    for altitude_m in (488.0, 489.2, 490.4, 491.6):
        told.see(1.0, home=at(altitude_m))
    told.restart()
    told.see(1.0)
    assert told.run.reason is None


def test_the_home_of_the_arming_may_be_told_during_the_takeoff() -> None:
    """HOME_POSITION comes once a second; GNSS may have drifted by metres since the home before."""
    told = Told()
    told.see(1.0, home=HOME, landed=LandedState.TAKING_OFF)
    told.see(1.0, home=at(492.0), landed=LandedState.TAKING_OFF)
    told.see(2.0, landed=LandedState.IN_AIR)
    assert told.run.reason is None
    assert told.run.home == at(492.0)
