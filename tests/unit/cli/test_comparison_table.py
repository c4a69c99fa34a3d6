"""The terminal shows predicted against flown, and says why where something is missing."""

from __future__ import annotations

from rich.console import Console

from app.cli.run_view import show_comparison
from app.domain.delivery.comparison import Comparison, DropComparison, ItemComparison
from app.domain.reasons import Reason
from tests.support.reasons import some


def shown(comparison: Comparison) -> list[str]:
    console = Console(width=140, record=True, quiet=False, force_terminal=False)
    with console.capture() as capture:
        show_comparison(console, comparison)
    return capture.get().splitlines()


def item(
    item_id: str, flown_s: float | None, *, visit: int = 1, uncertainty_s: float = 0.0, reason: Reason | None = None
) -> ItemComparison:
    percent = None if flown_s is None else 10.0 * (flown_s - 10.0)
    return ItemComparison(
        item_id=item_id,
        type="waypoint",
        visit=visit,
        predicted_s=10.0,
        flown_s=flown_s,
        difference_percent=percent,
        uncertainty_s=uncertainty_s,
        reason=reason,
    )


def drop(distance_m: float | None, reason: Reason | None = None) -> DropComparison:
    return DropComparison(
        item_id="parcel",
        predicted_latitude_deg=47.0,
        predicted_longitude_deg=8.0,
        predicted_offset_m=1.0,
        predicted_ground_speed_m_s=0.0,
        flown_latitude_deg=None if distance_m is None else 47.0,
        flown_longitude_deg=None if distance_m is None else 8.0,
        flown_offset_m=None if distance_m is None else 0.8,
        flown_ground_speed_m_s=None if distance_m is None else 0.1,
        distance_m=distance_m,
        reason=reason,
    )


def comparison(*items: ItemComparison, drops: tuple[DropComparison, ...] = ()) -> Comparison:
    return Comparison(run_id="r1", items=items, drops=drops, predicted_s=10.0, flown_s=11.0, reason=None)


def test_each_visit_has_a_row_with_both_times_and_the_difference() -> None:
    lines = shown(comparison(item("door", 11.0), item("door", 9.0, visit=2, uncertainty_s=3.0)))
    first = next(line for line in lines if "door " in line and "visit" not in line)
    second = next(line for line in lines if "door (visit 2)" in line)
    assert ("10.0 s" in first, "11.0 s" in first, "+10 %" in first) == (True, True, True)
    assert ("-10 %" in second, "uncertain by 3 s" in second) == (True, True)


def test_what_is_missing_says_why() -> None:
    lines = "\n".join(shown(comparison(item("door", None, reason=some("not flown: the run ended aborted")))))
    assert "not flown: the run ended aborted" in lines


def test_a_pause_is_named_beside_the_time_that_does_not_count_it() -> None:
    paused = {"paused_s": 64.8}
    lines = shown(comparison(item("door", 11.0).model_copy(update=paused)).model_copy(update=paused))
    named = [line for line in lines if "paused for 65 s, excluded" in line]
    assert [line.split()[1] for line in named] == ["door", "compared"]


def test_a_drop_has_its_distance_from_the_predicted_place_or_its_reason() -> None:
    lines = shown(comparison(item("door", 11.0), drops=(drop(1.4), drop(None, some("no release was sent: kept")))))
    assert "drop parcel: released 1.4 m from the predicted position, offset 1.0 predicted and 0.8 m flown" in lines[-2]
    assert "drop parcel: no release was sent: kept" in lines[-1]


def test_nothing_is_shown_of_a_run_without_items() -> None:
    assert shown(comparison()) == []
