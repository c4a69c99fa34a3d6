"""Progress counts each item once per visit, whatever MISSION_CURRENT and REACHED show or lose."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem
from app.domain.progress import Progress


def mission(count: int, jumps: dict[int, int] | None = None) -> Mission:
    items = tuple(
        MissionItem(seq, MavFrame.MISSION, MavCmd.DO_JUMP, param1=float((jumps or {})[seq]))
        if jumps and seq in jumps
        else MissionItem(seq, MavFrame.GLOBAL_RELATIVE_ALT_INT, MavCmd.NAV_WAYPOINT)
        for seq in range(count)
    )
    return Mission(items=items, plan_item_of={seq: f"i{seq}" for seq in range(count)})


def test_a_skipped_current_passes_what_lies_between() -> None:
    progress = Progress.of(mission(5)).now_current(0).now_current(1).now_current(3)
    assert progress.flown == ("i0", "i1", "i2")


def test_reached_repeated_ten_times_counts_once() -> None:
    progress = Progress.of(mission(3)).now_current(0)
    for _ in range(10):
        progress = progress.reached(0)
    assert progress.flown == ("i0",)


def test_the_last_item_is_passed_by_reached_or_by_complete() -> None:
    started = Progress.of(mission(2)).now_current(0).now_current(1)
    assert started.reached(1).is_complete
    assert started.completed().flown == ("i0", "i1")
    assert not started.is_complete


def test_a_jump_back_visits_its_items_again() -> None:
    progress = Progress.of(mission(5, jumps={3: 1}))
    for seq in (0, 1, 2, 1, 2, 4):
        progress = progress.now_current(seq)
    assert progress.flown == ("i0", "i1", "i2", "i1", "i2")


def test_a_reached_before_the_jump_does_not_count_twice() -> None:
    progress = Progress.of(mission(5, jumps={3: 1})).now_current(0).now_current(1).now_current(2).reached(2)
    assert progress.now_current(1).flown == ("i0", "i1", "i2")


def test_a_supervised_drop_comes_after_its_hold() -> None:
    progress = Progress.of(mission(4)).now_current(0).now_current(1)
    progress = progress.also_flown("drop", through_seq=1).now_current(2)
    assert progress.flown == ("i0", "i1", "drop")


def test_a_supervised_drop_that_waits_in_its_own_delay_counts_once() -> None:
    landed = Mission(items=mission(4).items, plan_item_of={0: "takeoff", 1: "yard", 2: "drop", 3: "leave"})
    progress = Progress.of(landed).now_current(0).now_current(2).also_flown("drop", through_seq=2).now_current(3)
    assert progress.flown == ("takeoff", "yard", "drop")


def test_reached_before_current_counts_once() -> None:
    progress = Progress.of(mission(3)).now_current(1).reached(2).now_current(2).completed()
    assert progress.flown == ("i0", "i1", "i2")


def test_several_items_of_one_plan_item_count_once() -> None:
    plain = mission(4)
    merged = Mission(items=plain.items, plan_item_of={0: "a", 1: "land", 2: "land", 3: "land"})
    assert Progress.of(merged).now_current(0).now_current(2).reached(3).flown == ("a", "land")


@given(st.lists(st.tuples(st.booleans(), st.integers(-1, 12))))
def test_flown_only_grows_and_names_only_items_of_the_mission(shown: list[tuple[bool, int]]) -> None:
    progress = Progress.of(mission(8, jumps={5: 2}))
    for is_current, seq in shown:
        following = progress.now_current(seq) if is_current else progress.reached(seq)
        assert following.flown[: len(progress.flown)] == progress.flown
        assert set(following.flown) <= {f"i{n}" for n in range(8)}
        progress = following
