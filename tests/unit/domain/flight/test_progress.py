"""Progress counts each item once per visit, whatever MISSION_CURRENT and REACHED show or lose."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import takewhile
from typing import NamedTuple

from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.flight.progress import MissionProgress
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem
from app.vehicles.link_watch import ItemVisits


def mission(count: int, jumps: dict[int, int] | None = None) -> Mission:
    items = tuple(
        MissionItem(seq, MavFrame.MISSION, MavCmd.DO_JUMP, param1=float((jumps or {})[seq]))
        if jumps and seq in jumps
        else MissionItem(seq, MavFrame.GLOBAL_RELATIVE_ALT_INT, MavCmd.NAV_WAYPOINT)
        for seq in range(count)
    )
    return Mission(items=items, plan_item_of={seq: f"i{seq}" for seq in range(count)})


def test_a_skipped_current_passes_what_lies_between() -> None:
    progress = MissionProgress.of(mission(5)).now_current(0).now_current(1).now_current(3)
    assert progress.flown == ("i0", "i1", "i2")


def test_reached_repeated_ten_times_counts_once() -> None:
    progress = MissionProgress.of(mission(3)).now_current(0)
    for _ in range(10):
        progress = progress.reached(0)
    assert progress.flown == ("i0",)


def test_the_last_item_is_passed_by_reached_or_by_complete() -> None:
    started = MissionProgress.of(mission(2)).now_current(0).now_current(1)
    assert started.reached(1).is_complete
    assert started.completed().flown == ("i0", "i1")
    assert not started.is_complete


def test_a_jump_back_visits_its_items_again() -> None:
    progress = MissionProgress.of(mission(5, jumps={3: 1}))
    for seq in (0, 1, 2, 1, 2, 4):
        progress = progress.now_current(seq)
    assert progress.flown == ("i0", "i1", "i2", "i1", "i2")


def test_a_reached_before_the_jump_does_not_count_twice() -> None:
    progress = MissionProgress.of(mission(5, jumps={3: 1})).now_current(0).now_current(1).now_current(2).reached(2)
    assert progress.now_current(1).flown == ("i0", "i1", "i2")


def test_a_supervised_drop_comes_after_its_hold() -> None:
    progress = MissionProgress.of(mission(4)).now_current(0).now_current(1)
    progress = progress.also_flown("drop", through_seq=1).now_current(2)
    assert progress.flown == ("i0", "i1", "drop")


def test_a_supervised_drop_that_waits_in_its_own_delay_counts_once() -> None:
    landed = Mission(items=mission(4).items, plan_item_of={0: "takeoff", 1: "yard", 2: "drop", 3: "leave"})
    progress = MissionProgress.of(landed).now_current(0).now_current(2).also_flown("drop", through_seq=2).now_current(3)
    assert progress.flown == ("takeoff", "yard", "drop")


def test_a_drop_in_its_own_delay_that_the_vehicle_has_left_unseen_counts_once() -> None:
    landed = Mission(items=mission(5).items, plan_item_of={0: "takeoff", 1: "yard", 2: "drop", 3: "leave", 4: "return"})
    progress = MissionProgress.of(landed).now_current(0).now_current(2).now_current(4)
    assert progress.also_flown("drop", through_seq=2).flown == ("takeoff", "yard", "drop", "leave")


def test_reached_before_current_counts_once() -> None:
    progress = MissionProgress.of(mission(3)).now_current(1).reached(2).now_current(2).completed()
    assert progress.flown == ("i0", "i1", "i2")


def test_several_items_of_one_plan_item_count_once() -> None:
    plain = mission(4)
    merged = Mission(items=plain.items, plan_item_of={0: "a", 1: "land", 2: "land", 3: "land"})
    assert MissionProgress.of(merged).now_current(0).now_current(2).reached(3).flown == ("a", "land")


@given(st.lists(st.tuples(st.booleans(), st.integers(-1, 12))))
def test_flown_only_grows_and_names_only_items_of_the_mission(shown: list[tuple[bool, int]]) -> None:
    progress = MissionProgress.of(mission(8, jumps={5: 2}))
    for is_current, seq in shown:
        following = progress.now_current(seq) if is_current else progress.reached(seq)
        assert following.flown[: len(progress.flown)] == progress.flown
        assert set(following.flown) <= {f"i{n}" for n in range(8)}
        progress = following


class Told(NamedTuple):
    """A message on its way: `at_s` is when it comes."""

    at_s: float
    name: str
    seq: int


class Flight(NamedTuple):
    """`done_s` is when each item of the route was passed; `messages` what came of it."""

    mission: Mission
    route: tuple[int, ...]
    done_s: tuple[float, ...]
    messages: tuple[Told, ...]


@st.composite
def flights(draw: st.DrawFn) -> Flight:
    """A flight over a loop, with a return at its end, and its messages within what PX4 does.

    MISSION_CURRENT and REACHED come in their own order, each up to a second late, repeated at 1 Hz, with losses. The
    items but those that the loop begins and ends with may be current for a moment only. A return is reached at once.
    """
    laps = draw(st.integers(1, 3))
    begin, end = draw(st.sampled_from([(1, 2), (1, 3), (2, 4)]))
    last = end + 1 + draw(st.integers(1, 3))
    route = (*range(begin), *(seq for _ in range(laps) for seq in range(begin, end + 1)), *range(end + 2, last + 1))
    shown: list[Told] = []
    reached: list[Told] = []
    at_s, done_s = 0.0, list[float]()
    for place, seq in enumerate(route):
        blinks = seq not in (begin, end, last) and draw(st.booleans())
        began_s, took_s = at_s, 0.02 if blinks else draw(st.sampled_from([3.0, 5.0, 14.0]))
        late_s = draw(st.sampled_from([0.0, 0.5, 0.99]))
        kept = draw(st.integers(0, 1))  # of the repetitions the first may be lost
        if not blinks or draw(st.booleans()):
            shown += [Told(at_s + late_s + n, "current", seq) for n in range(kept, max(1, int(took_s)))]
        at_s = began_s + took_s
        done_s.append(began_s if seq == last else at_s)
        late_s = draw(st.sampled_from([0.0, 0.5, 0.99]))
        if place == len(route) - 1 or draw(st.booleans()):  # that of the last item is repeated, and one arrives
            first = draw(st.integers(0, 2))
            reached += [Told(done_s[-1] + late_s + n, "reached", seq) for n in range(first, 11)]
    return Flight(mission(last + 1, {end + 1: begin}), route, tuple(done_s), _in_order(draw, shown, reached))


def _in_order(draw: st.DrawFn, shown: list[Told], reached: list[Told]) -> tuple[Told, ...]:
    """Each of the two streams repeats its newest only."""
    streams = []
    for told in (shown, reached):
        begins = [(place, one) for place, one in enumerate(told) if place == 0 or told[place - 1].seq != one.seq]
        ends = [min((later.at_s for _, later in begins[n:]), default=math.inf) for n in range(1, len(begins) + 1)]
        kept: list[Told] = []
        for (place, first), until_s in zip(begins, ends, strict=True):
            following = takewhile(lambda one, first=first: one.seq == first.seq, told[place:])  # type: ignore[misc]
            kept += [one for one in following if one.at_s < until_s]
        streams.append(kept)
    merged = sorted([*streams[0], *streams[1]], key=lambda one: (one.at_s, draw(st.booleans())))
    return tuple(merged)


@settings(max_examples=200, deadline=None)
@given(flights(), st.data())
def test_the_same_items_are_flown_whatever_the_order_in_which_the_messages_are_handled(
    flight: Flight, data: st.DataObject
) -> None:
    visited = tuple(f"i{seq}" for seq in flight.route)
    progress, visits, newest = MissionProgress.of(flight.mission), ItemVisits(), None
    for at_s, name, seq in flight.messages:
        reached = visits.now_current(seq) if name == "current" else seq if visits.reached(seq, at_s) else None
        if reached is not None:
            progress = (progress.begun(reached) if reached == progress.last_seq else progress).reached(reached)
        if name == "current":
            newest, progress = seq, progress.now_current(seq)
        if newest is not None and data.draw(st.booleans()):
            progress = progress.now_current(newest)  # a look reads what came last
        passed = sum(done_s <= at_s for done_s in flight.done_s)
        assert len(progress.flown) <= passed, (progress.flown, at_s, name, seq)
        assert visited[: len(progress.flown)] == progress.flown, (at_s, name, seq)
    assert progress.flown == visited


def test_a_return_that_begins_before_it_is_shown_as_current_counts_nothing_twice() -> None:
    """REACHED of the return, then a look at a MISSION_CURRENT that is up to a second old."""
    started = MissionProgress.of(mission(4)).now_current(0).now_current(2)
    returning = started.begun(3).reached(3)
    assert returning.now_current(2).now_current(3).completed().flown == ("i0", "i1", "i2", "i3")
    assert returning.now_current(2).item_id == "i3", "it does not seem to fly back"


def test_the_reached_of_the_visit_before_says_nothing_of_the_next() -> None:
    """PX4 sends MISSION_CURRENT before the REACHED of the same moment: here of the jump back."""
    progress = MissionProgress.of(mission(5, jumps={3: 1})).now_current(0).now_current(1).now_current(2).now_current(1)
    assert progress.reached(2).flown == ("i0", "i1", "i2")


def test_a_jump_to_an_item_that_is_current_for_a_moment_passes_what_lay_before_it() -> None:
    """A speed change before the waypoint: MISSION_CURRENT may never show the item that the jump leads to."""
    looped = mission(6, jumps={4: 1})
    items = (looped.items[0], replace(looped.items[1], command=MavCmd.DO_CHANGE_SPEED), *looped.items[2:])
    progress = (
        MissionProgress.of(replace(looped, items=items)).now_current(0).now_current(2).now_current(3).now_current(2)
    )
    assert progress.flown == ("i0", "i1", "i2", "i3", "i1")
