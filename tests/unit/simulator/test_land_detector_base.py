"""What all land detectors share: hysteresis, publishing, rest, flight time, the wire."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.simulator.land_detector.base import Hysteresis, landed_state
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import LandedState, Mode
from tests.support.landing_vehicle import FLYING, STANDING, LandDetectorHarness

DISARMED = replace(STANDING, armed=False)


@given(st.lists(st.booleans(), max_size=60), st.integers(0, 9), st.integers(0, 9))
def test_a_state_changes_only_after_its_input_stayed_the_other_way_for_its_time(
    inputs: list[bool], rise: int, fall: int
) -> None:
    hysteresis = Hysteresis()
    hysteresis.rise_s, hysteresis.fall_s = rise, fall
    for now, wanted in enumerate(inputs):
        before = hysteresis.state
        after = hysteresis.update(wanted, float(now))
        run = inputs[max(0, now - (rise if wanted else fall)) : now + 1]
        stayed = len(run) == (rise if wanted else fall) + 1 and set(run) == {wanted}
        assert after is (wanted if stayed else before) or (after is wanted and before is wanted)


def test_a_state_that_is_asked_for_again_waits_anew() -> None:
    hysteresis = Hysteresis()
    hysteresis.rise_s = 1.0
    answers = [hysteresis.update(wanted, now) for wanted, now in ((True, 0.0), (False, 0.9), (True, 1.0), (True, 1.9))]
    assert answers == [False] * 4
    assert hysteresis.update(True, 2.0)


def test_it_publishes_once_a_second_and_at_once_when_a_state_changes() -> None:
    harness = LandDetectorHarness("rover")
    harness.feed(DISARMED, 3.0)
    published_s = sorted({harness.feed(DISARMED, 0.02).published_at_s for _ in range(200)})
    gaps_s = [later - earlier for earlier, later in itertools.pairwise(published_s)]
    assert len(gaps_s) >= 3
    assert gaps_s == pytest.approx([1.0] * len(gaps_s), abs=0.03)
    changed_s = harness.seconds_until("landed", False, FLYING)
    assert changed_s == pytest.approx(0.5, abs=0.05)
    assert harness.land.published_at_s == harness.clock.now_s


def test_at_rest_needs_a_second_without_rotation_and_without_turning_motors() -> None:
    harness = LandDetectorHarness("quad")
    harness.feed(replace(DISARMED, throttle=0.12), 2.0)
    assert not harness.land.at_rest
    assert harness.seconds_until("at_rest", True, DISARMED) == pytest.approx(1.0, abs=0.05)
    assert not harness.feed(replace(DISARMED, rate_rad_s=0.1), 0.02).at_rest
    harness.feed(DISARMED, 2.0)
    assert not harness.feed(replace(DISARMED, v_xy_m_s=0.2), 0.02).at_rest


def test_at_rest_needs_landed() -> None:
    harness = LandDetectorHarness("airship")
    assert harness.never("at_rest", replace(STANDING, armed=True), 3.0)


def flight_us(harness: LandDetectorHarness) -> int:
    high, low = harness.params.integer("LND_FLIGHT_T_HI"), harness.params.integer("LND_FLIGHT_T_LO")
    return high * 2**32 + low % 2**32


def test_the_flight_time_counts_from_the_take_off_to_the_disarming_and_is_stored_then() -> None:
    harness = LandDetectorHarness("airship")
    harness.feed(replace(FLYING, armed=False), 1.0)
    harness.feed(FLYING, 10.0)
    assert flight_us(harness) == 0
    harness.feed(DISARMED, 1.0)
    assert flight_us(harness) == 10_000_000
    harness.feed(FLYING, 5.0)
    harness.feed(DISARMED, 1.0)
    assert flight_us(harness) == 15_000_000


def test_a_reboot_in_the_air_loses_the_flight_time_until_then() -> None:
    harness = LandDetectorHarness("quad")
    harness.feed(DISARMED, 2.0)
    harness.feed(FLYING, 10.0)
    harness.reboot()
    harness.feed(FLYING, 3.0)
    harness.feed(DISARMED, 1.0)
    assert flight_us(harness) == 3_000_000


@pytest.mark.parametrize("airframe", ["quad", "plane", "vtol", "rover", "airship"])
def test_after_a_reboot_it_has_landed_until_the_contrary_is_seen(airframe: str) -> None:
    harness = LandDetectorHarness(airframe, LNDFW_TRIG_TIME=5.0, LNDMC_TRIG_TIME=5.0)
    harness.feed(FLYING, 3.0)
    assert not harness.land.landed
    harness.reboot()
    assert harness.feed(DISARMED, 0.02).landed


def test_landings_on_the_way_do_not_stop_the_flight_time() -> None:
    harness = LandDetectorHarness("quad")
    harness.feed(FLYING, 4.0)
    harness.feed(STANDING, 3.0)
    assert harness.land.landed
    harness.feed(FLYING, 3.0)
    harness.feed(DISARMED, 1.0)
    assert flight_us(harness) == 10_000_000


@pytest.mark.parametrize("before_us", [2**31 - 1, 2**32 - 1, 5 * 2**32])
def test_the_flight_time_has_64_bits_in_two_signed_parameters(before_us: int) -> None:
    low = before_us % 2**32
    harness = LandDetectorHarness(
        "airship", LND_FLIGHT_T_HI=before_us // 2**32, LND_FLIGHT_T_LO=low - 2**32 if low >= 2**31 else low
    )
    harness.feed(FLYING, 1.0)
    harness.feed(DISARMED, 0.1)
    assert flight_us(harness) == before_us + 1_000_000
    harness.params.encode("LND_FLIGHT_T_LO")  # fits an int32


@pytest.mark.parametrize(
    ("landed", "mode", "kind", "expected"),
    [
        (True, Mode.MISSION, SetpointKind.TAKEOFF, LandedState.ON_GROUND),
        (False, Mode.MISSION, SetpointKind.TAKEOFF, LandedState.TAKEOFF),
        (False, Mode.LAND, SetpointKind.LAND, LandedState.LANDING),
        (False, Mode.MISSION, SetpointKind.POSITION, LandedState.IN_AIR),
        (False, Mode.LOITER, SetpointKind.LOITER, LandedState.IN_AIR),
        (False, Mode.POSCTL, SetpointKind.LAND, LandedState.IN_AIR),
        (False, Mode.OFFBOARD, SetpointKind.TAKEOFF, LandedState.IN_AIR),
    ],
)
def test_takeoff_and_landing_on_the_wire_are_the_setpoints_type_in_auto_modes(
    landed: bool, mode: Mode, kind: SetpointKind, expected: LandedState
) -> None:
    assert landed_state(landed, mode, kind) is expected
