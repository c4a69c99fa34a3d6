"""An embedded drop says only what was seen: never more than inferred."""

from __future__ import annotations

import pytest

from app.domain.drop.embedded import EmbeddedDrop, EmbeddedObservation
from app.domain.drop.record import Certainty, DropOutcome
from app.domain.reasons import Reason, ReasonCode, describe

LANDED = Reason.of(ReasonCode.ENDED_EARLY)


def sight(
    now_s: float, *, passed: bool = False, output_us: int | None = 2000, connected: bool = True, **others: bool
) -> EmbeddedObservation:
    return EmbeddedObservation(now_s, connected, passed, output_us, None if output_us is None else 0.1, **others)


def after(*sights: EmbeddedObservation) -> tuple[DropOutcome, Certainty] | None:
    drop = EmbeddedDrop()
    for seen in sights:
        drop = drop.saw(seen)
    return None if drop.finish is None else (drop.finish.outcome, drop.finish.certainty)


def test_an_output_that_goes_from_grab_to_release_is_a_release_by_inference() -> None:
    assert after(sight(0), sight(1, passed=True, output_us=1000)) == (DropOutcome.RELEASED, Certainty.INFERRED)


def test_the_output_may_show_before_the_progress_does() -> None:
    assert after(sight(0), sight(1, output_us=1000, at_item=True)) == (DropOutcome.RELEASED, Certainty.INFERRED)


def test_an_output_that_stays_at_grab_keeps_the_parcel() -> None:
    assert after(sight(0), sight(1, passed=True), sight(4, passed=True)) == (DropOutcome.KEPT, Certainty.INFERRED)


def test_reached_alone_proves_nothing() -> None:
    seen = (sight(0, output_us=None), sight(1, passed=True, output_us=None), sight(4, passed=True, output_us=None))
    assert after(*seen) == (DropOutcome.UNKNOWN, Certainty.NONE)


def test_a_gripper_left_open_by_the_last_flight_is_unknown() -> None:
    assert after(sight(0, output_us=1000)) is None
    assert after(sight(0, output_us=1000), sight(1, passed=True, output_us=1000)) == (
        DropOutcome.UNKNOWN,
        Certainty.NONE,
    )


def reason_after(*sights: EmbeddedObservation) -> ReasonCode | None:
    drop = EmbeddedDrop()
    for seen in sights:
        drop = drop.saw(seen)
    return None if drop.finish is None or drop.finish.reason is None else drop.finish.reason.code


def test_a_gripper_that_nobody_observed_before_the_item_is_not_called_open_before() -> None:
    """As after a restart of Waydrop behind the item, or at it: the gripper had been closed before takeoff."""
    passed = sight(1, passed=True, output_us=1000)
    assert after(passed) == (DropOutcome.UNKNOWN, Certainty.NONE)
    assert reason_after(passed) is ReasonCode.ITEM_OPENING_UNSEEN
    assert reason_after(sight(0, output_us=1000, at_item=True), passed) is ReasonCode.ITEM_OPENING_UNSEEN
    assert reason_after(sight(0, output_us=1000), passed) is ReasonCode.ITEM_OPEN_BEFORE


def test_a_link_lost_over_the_drop_is_settled_when_it_is_back() -> None:
    lost = sight(5, connected=False)
    assert after(sight(0), lost) is None
    assert after(sight(0), lost, sight(60, passed=True, output_us=1000)) == (DropOutcome.RELEASED, Certainty.INFERRED)


@pytest.mark.parametrize(("passed", "outcome"), [(False, DropOutcome.KEPT), (True, DropOutcome.UNKNOWN)])
def test_the_end_of_the_run_closes_it(passed: bool, outcome: DropOutcome) -> None:
    drop = EmbeddedDrop().saw(sight(0, passed=passed)).ended(LANDED)
    assert drop.finish is not None
    assert drop.finish.outcome is outcome


def test_an_opening_on_the_way_to_another_item_is_not_this_drops() -> None:
    opened = (sight(0), sight(1, output_us=1000), sight(4, output_us=1000), sight(5, output_us=1000, at_item=True))
    assert after(*opened) is None
    assert after(*opened, sight(9, output_us=1000, passed=True)) == (DropOutcome.UNKNOWN, Certainty.NONE)


def test_an_opening_counts_although_the_current_item_shows_a_second_late() -> None:
    opened = (sight(0), sight(1, output_us=1000), sight(2, output_us=1000, at_item=True))
    assert after(*opened) == (DropOutcome.RELEASED, Certainty.INFERRED)


def test_a_parcel_whose_gripper_opened_elsewhere_is_not_called_kept() -> None:
    drop = EmbeddedDrop().saw(sight(0)).saw(sight(1, output_us=1000)).saw(sight(9, output_us=900)).ended(LANDED)
    assert drop.finish is not None
    assert drop.finish.outcome is DropOutcome.UNKNOWN


def test_what_was_closed_before_an_earlier_release_says_nothing() -> None:
    first = (sight(0, earlier_passed=False), sight(1, output_us=1000, earlier_passed=False))
    stuck = (sight(2, output_us=1000, at_item=True), sight(3, output_us=1000, passed=True))
    assert after(*first, *stuck) == (DropOutcome.UNKNOWN, Certainty.NONE), "nothing was grabbed in between"
    grabbed = (sight(2), sight(3, output_us=1000, at_item=True))
    assert after(*first, *grabbed) == (DropOutcome.RELEASED, Certainty.INFERRED)


def test_a_grab_or_a_release_that_came_later_hides_what_became_of_the_item() -> None:
    gone = sight(1, connected=False)
    assert after(sight(0), gone, sight(9, passed=True, regrabbed=True), sight(12, passed=True, regrabbed=True)) == (
        DropOutcome.UNKNOWN,
        Certainty.NONE,
    )
    reopened = sight(9, passed=True, output_us=1000, regrabbed=True, reopened=True)
    assert after(sight(0), gone, reopened) == (DropOutcome.UNKNOWN, Certainty.NONE)


def test_a_winch_is_not_explained_by_the_output_of_a_gripper() -> None:
    drop = EmbeddedDrop()
    for at_s in (0, 4):
        drop = drop.saw(sight(at_s, passed=True, output_us=None, has_gripper=False))
    assert drop.finish is not None
    assert (drop.finish.outcome, drop.finish.certainty) == (DropOutcome.UNKNOWN, Certainty.NONE)
    assert "winch" in describe(drop.finish.reason)
    assert "gripper" not in describe(drop.finish.reason)


def test_a_winch_is_not_done_before_the_time_that_the_plan_gives_it() -> None:
    """Else the contingency would command a return while the line is out."""
    lowering = {"passed": True, "output_us": None, "has_gripper": False}
    drop = EmbeddedDrop()
    for at_s in (0, 4, 14):
        drop = drop.saw(sight(at_s, settled=False, **lowering))
    assert drop.finish is None
    drop = drop.saw(sight(16, **lowering))
    assert drop.finish is not None
    assert drop.finish.outcome is DropOutcome.UNKNOWN
    interrupted = EmbeddedDrop().saw(sight(0, settled=False, **lowering)).ended(LANDED)
    assert interrupted.finish is not None
    assert interrupted.finish.outcome is DropOutcome.UNKNOWN
