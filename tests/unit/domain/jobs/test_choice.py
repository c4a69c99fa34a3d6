"""Which vehicle gets a job: the nearest that can, then battery, then id; always the same, with reasons."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.domain.jobs.assignment import NEAR_M, choose, chosen_of
from app.domain.jobs.job import Candidate, Refusal

REFUSED = (Refusal(code="vehicle.busy", message="it has run r"),)
CANDIDATES = st.lists(
    st.builds(
        Candidate,
        vehicle_id=st.integers(1, 30).map(lambda number: f"v{number}"),
        distance_m=st.none() | st.floats(0.0, 100.0),
        battery_percent=st.none() | st.floats(0.0, 100.0),
        refusals=st.sampled_from([(), (), REFUSED]),
    ),
    unique_by=lambda one: one.vehicle_id,
    max_size=8,
)


def at(vehicle_id: str, distance_m: float | None, battery_percent: float | None = 50.0) -> Candidate:
    return Candidate(vehicle_id=vehicle_id, distance_m=distance_m, battery_percent=battery_percent)


@given(CANDIDATES, st.randoms(use_true_random=False))
def test_the_choice_hangs_on_the_vehicles_alone(candidates: list[Candidate], random: st.DataObject) -> None:
    before = choose(candidates)
    random.shuffle(candidates)  # type: ignore[attr-defined]
    assert choose(candidates) == before
    assert [one.vehicle_id for one in before] == sorted(
        (one.vehicle_id for one in candidates), key=lambda name: int(name[1:])
    )


@given(CANDIDATES)
def test_one_that_can_is_chosen_if_there_is_any_and_each_that_can_has_a_reason(candidates: list[Candidate]) -> None:
    told = choose(candidates)
    chosen = [one for one in told if one.chosen]
    able = [one for one in told if one.can]
    assert len(chosen) == min(1, len(able))
    assert all((one.reason is not None) is one.can for one in told)
    if chosen and chosen[0].distance_m is not None:
        known = [one.distance_m for one in able if one.distance_m is not None]
        assert chosen[0].distance_m <= min(known) + NEAR_M


def test_the_nearest_comes_first_then_battery_then_number() -> None:
    def first(*candidates: Candidate) -> str:
        chosen = chosen_of(choose(candidates))
        assert chosen is not None
        return chosen.vehicle_id

    assert first(at("v1", 80.0, 99.0), at("v2", 20.0, 40.0)) == "v2"
    assert first(at("v1", 20.0 + NEAR_M, 99.0), at("v2", 20.0, 40.0)) == "v1", "as near, and with more battery"
    assert first(at("v10", 5.0), at("v9", 5.0)) == "v9"
    assert first(at("v1", None, 99.0), at("v2", 5000.0, 1.0)) == "v2", "whose place is not known comes last"
    assert first(at("v1", 0.0, None), at("v2", 0.0, 1.0)) == "v2"


def test_nobody_is_chosen_where_nobody_can() -> None:
    assert chosen_of(choose([Candidate(vehicle_id="v1", refusals=REFUSED)])) is None
    assert choose([]) == ()
