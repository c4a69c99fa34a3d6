"""The vehicle clock tells the speed factor, and forgets it over a reboot."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.vehicle.clock import VehicleClock, is_too_fast, needs_longer_look


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0, 20.0])
def test_the_rate_is_the_speed_factor(factor: float) -> None:
    clock = VehicleClock()
    for n in range(30):
        clock = clock.seen(100 + n * 0.1001, 5 + n * 0.1001 * factor)
    assert clock.rate == pytest.approx(factor, rel=0.02)


def test_a_told_rate_counts_at_once_and_until_the_clock_is_measured_anew() -> None:
    clock = heard(1.0, 10.0).set_to(20.0)
    assert (clock.rate, clock.least_rate) == (20.0, 20.0)
    for n in range(30):  # a machine too slow for it
        clock = clock.seen(200 + n * 0.1001, 5 + n * 0.1001 * 3.0)
    assert clock.rate == pytest.approx(3.0, rel=0.02)
    assert not is_too_fast(clock.least_rate)


def heard(rate: float, seconds: float, late: Callable[[float], float] = lambda _: 0.0) -> VehicleClock:
    """After `seconds` of ours, positions at 10 Hz of ours; `late` says how late one that left at this time comes."""
    clock = VehicleClock(window_s=10.0)
    arrivals = sorted((n * 0.1 + late(n * 0.1), n) for n in range(round(seconds * 10) + 1))
    for arrived_s, n in arrivals:
        clock = clock.seen(100.0 + arrived_s, n * 0.1 * rate)
    return clock


@pytest.mark.parametrize(("rate", "seconds"), [(5.0, 9.0), (8.0, 3.0), (10.0, 2.0), (50.0, 1.1)])
def test_a_clock_that_runs_too_fast_is_found_out_sooner_the_faster_it_is(rate: float, seconds: float) -> None:
    assert is_too_fast(heard(rate, seconds).least_rate)


@given(
    seconds=st.floats(1.0, 30.0),
    lateness=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=400),
    rate=st.sampled_from([1.0, 4.0]),
)
def test_messages_that_come_up_to_a_second_late_make_no_four_too_fast(
    seconds: float, lateness: list[float], rate: float
) -> None:
    clock = heard(rate, seconds, lambda s: lateness[round(s * 10) % len(lateness)])
    assert not is_too_fast(clock.least_rate)


@pytest.mark.parametrize("stood_still_s", [3.0, 20.0, 60.0])
def test_a_heap_of_messages_after_a_silence_does_not_make_a_real_vehicle_too_fast(stood_still_s: float) -> None:
    for after_s in range(30):
        clock = heard(1.0, stood_still_s + after_s / 10, lambda s: max(0.0, stood_still_s - s))
        assert not is_too_fast(clock.least_rate)


def test_a_rate_that_may_be_chance_is_looked_at_until_it_is_decided() -> None:
    assert needs_longer_look(heard(5.0, 2.0))
    assert not needs_longer_look(heard(5.0, 9.5)), "it is too fast"
    assert not needs_longer_look(heard(4.0, 2.0))
    assert not needs_longer_look(heard(1.0, 2.0))
    assert not needs_longer_look(heard(5.0, 0.5)), "not measured: a real vehicle is not kept waiting"
    assert not needs_longer_look(heard(4.5, 12.0)), "longer would tell no more"


@pytest.mark.parametrize("rate", [1.0, 4.0, 20.0])
def test_a_link_that_reorders_is_measured_all_the_same(rate: float) -> None:
    clock = VehicleClock()
    for n in range(40):
        overtaken_s = 0.15 if n % 3 == 2 else 0.0
        clock = clock.seen(100.0 + n * 0.1, 50.0 + (n * 0.1 - overtaken_s) * rate)
    assert clock.is_measured
    assert clock.rate == pytest.approx(rate, rel=0.1)


@given(order=st.permutations(range(12)))
def test_no_order_of_messages_makes_the_clock_run_backwards(order: list[int]) -> None:
    clock = VehicleClock()
    for n, sent in enumerate(order):
        clock = clock.seen(100.0 + n * 0.15, 50.0 + sent * 0.15)
        boots = [boot_s for _, boot_s in clock.samples]
        assert boots == sorted(boots)


def test_it_is_one_until_known_and_after_a_reboot() -> None:
    clock = VehicleClock().seen(0, 10).seen(3, 40)
    assert clock.rate == pytest.approx(10)
    assert clock.seen(4, 0.2).rate == 1.0


@pytest.mark.parametrize(
    ("arrivals_s", "rate"),
    [
        ((0.0, 1.0, 2.0, 3.0, 4.0), 1.0),
        ((1.8, 1.8, 2.0, 3.0, 4.0), 1.0),
        ((0.0, 1.0, 2.0, 3.0, 5.5), 1.0),
        ((0.0, 0.25, 0.5, 0.75, 1.0), 4.0),
    ],
)
def test_a_link_that_holds_messages_back_makes_no_vehicle_fly_faster_or_slower(
    arrivals_s: tuple[float, ...], rate: float
) -> None:
    """One message for each second of the vehicle's. The last ones come from a simulated vehicle."""
    clock = VehicleClock()
    for boot_s, now_s in enumerate(arrivals_s):
        clock = clock.seen(now_s, float(boot_s))
    assert clock.sure_rate == pytest.approx(rate)
