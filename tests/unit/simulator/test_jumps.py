"""DO_JUMP: how often, where to, and what a jump to nowhere does."""

from __future__ import annotations

import math

import pytest

from app.simulator.mission.item import Item
from app.simulator.navigator.mission_mode import JumpCounter
from app.simulator.wire import Cmd
from tests.support.simulated_vehicle import GroundStation, do, land, takeoff, waypoint


def items(*jumps: tuple[int, float, float]) -> list[Item]:
    """Six waypoints; jump seq, target and repeats replace some."""
    plan = [Item(16, 6, 1, 0, 0, 0, math.nan, 0, 0, 10.0) for _ in range(6)]
    for seq, target, repeats in jumps:
        plan[seq] = Item(Cmd.DO_JUMP, 2, 1, target, repeats, 0, 0, 0, 0, 0)
    return plan


def visits(plan: list[Item], most: int = 100) -> list[int]:
    counter, found = JumpCounter(), list[int]()
    seq: int | None = 0
    while seq is not None and len(found) < most:
        found.append(seq)
        seq = counter.after(plan, seq)
    return found


@pytest.mark.parametrize("repeats", [1, 2, 3])
def test_a_jump_is_taken_as_often_as_it_repeats(repeats: int) -> None:
    assert visits(items((3, 1, repeats))) == [0, 1, 2, *[1, 2] * repeats, 4, 5]


def test_after_a_reset_it_is_taken_as_often_again() -> None:
    counter, plan = JumpCounter(), items((3, 1, 1))
    assert [counter.after(plan, 2), counter.after(plan, 2)] == [1, 4]
    counter.reset()
    assert [counter.after(plan, 2), counter.after(plan, 2)] == [1, 4]


@pytest.mark.parametrize("repeats", [0, 0.9])
def test_a_jump_of_no_repeats_is_none(repeats: float) -> None:
    assert visits(items((3, 1, repeats))) == [0, 1, 2, 4, 5]


def test_minus_one_repeats_for_ever() -> None:
    assert set(visits(items((3, 1, -1)), 300)[1:]) == {1, 2}
    assert len(visits(items((1, 0, -1)), 65_600)) == 65_600, "also more often than PX4 can count"


def test_jumps_one_behind_the_other_are_all_taken() -> None:
    plan = items((0, 1, 1), (1, 2, 1), (2, 3, 1), (3, 4, 1), (4, 5, 1))
    assert JumpCounter().resolve(plan, 0) == 5


@pytest.mark.parametrize("target", [-1, 6, 99])
def test_a_jump_to_an_item_that_is_missing_ends_the_mission(target: int) -> None:
    assert visits(items((3, target, 2))) == [0, 1, 2]


def test_jumps_in_a_circle_end_the_mission() -> None:
    assert visits(items((2, 3, -1), (3, 2, -1))) == [0, 1]


def test_a_second_flight_counts_anew() -> None:
    gcs = GroundStation()
    plan = [takeoff(3), waypoint(4, 0, 3, 0, 2), waypoint(0, 4, 3, 0, 2), do(Cmd.DO_JUMP, 1, 1), land()]
    for flight in (1, 2):
        begin_s = gcs.now_s
        if flight == 1:
            gcs.start(plan)
        else:
            gcs.arm()
            gcs.command(Cmd.MISSION_START)
        gcs.until(lambda: not gcs.armed)
        visited = [message.seq for message in gcs.messages("MISSION_ITEM_REACHED", begin_s)]
        flips = [seq for index, seq in enumerate(visited) if index == 0 or visited[index - 1] != seq]
        assert flips.count(2) == 2, f"flight {flight}"


def test_a_jump_that_was_taken_is_sent_again_to_whom_the_last_transfer_was_with() -> None:
    """PX4 does so unasked, whenever the number of jumps that are left changes (mavlink_mission.cpp)."""
    gcs = GroundStation()
    plan = [takeoff(3), waypoint(4, 0, 3, 0, 2), waypoint(0, 4, 3, 0, 2), do(Cmd.DO_JUMP, 1, 2), land()]
    gcs.start(plan)
    begin_s = gcs.now_s
    gcs.until(lambda: not gcs.armed)
    told = gcs.messages("MISSION_ITEM_INT", begin_s)
    assert [(message.seq, message.command) for message in told] == [(3, Cmd.DO_JUMP)] * 2
