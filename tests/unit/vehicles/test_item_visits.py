"""One MISSION_ITEM_REACHED alone, which anybody could have forged, counts nothing."""

from __future__ import annotations

import pytest

from app.vehicles.link_watch import ItemVisits


def visits_at(*shown: int) -> ItemVisits:
    """MISSION_CURRENT has shown these, in this order."""
    visits = ItemVisits()
    for seq in shown:
        visits.now_current(seq)
    return visits


@pytest.mark.parametrize("seq", [0, 2, 3, 9])
def test_one_report_alone_says_nothing(seq: int) -> None:
    assert not visits_at(0, 1, 2).reached(seq, 10.0)


def test_it_counts_once_the_vehicle_goes_on_to_another_item() -> None:
    visits = visits_at(0, 1, 2)
    assert not visits.reached(2, 10.0)
    assert visits.now_current(3) == 2
    assert not visits.reached(2, 11.0), "a repetition"


def test_it_counts_once_it_is_repeated_while_its_item_is_current() -> None:
    visits = visits_at(0, 1, 2)
    assert not visits.reached(2, 10.0)
    assert visits.reached(2, 11.0)
    assert not visits.reached(2, 12.0), "a repetition"
    assert visits.now_current(3) is None, "told before"


def test_repetitions_for_an_item_that_is_not_current_say_nothing() -> None:
    visits = visits_at(0, 1, 2)
    assert not any(visits.reached(9, 10.0 + second) for second in range(12))
    assert visits.now_current(3) is None


def test_one_that_comes_after_the_next_item_is_shown_counts_at_once() -> None:
    assert visits_at(0, 1, 2, 3).reached(2, 10.0)


def test_one_for_an_item_that_was_current_for_too_short_to_be_shown_counts() -> None:
    visits = visits_at(0, 1)
    assert not visits.reached(2, 10.0)
    assert visits.now_current(3) == 2


def test_a_forged_report_does_not_keep_the_true_one_from_counting() -> None:
    visits = visits_at(0, 1, 2)
    assert not visits.reached(9, 9.9)
    assert not visits.reached(2, 10.0)
    assert not visits.reached(9, 10.1)
    assert not visits.reached(2, 11.0)
    assert not visits.reached(9, 11.1)
    assert visits.now_current(3) is None
    assert visits.reached(2, 12.0)


def test_repetitions_from_before_a_step_back_do_not_confirm_the_next_visit() -> None:
    """The first reports of item 2 were lost, and a jump leads back to it while the later ones still come."""
    visits = visits_at(1, 2, 3, 4)
    assert not visits.reached(2, 11.5)
    assert visits.now_current(2) is None
    assert not any(visits.reached(2, 12.5 + second) for second in range(5))
    assert visits.now_current(3) is None
    assert visits.reached(2, 30.0), "the second visit"
