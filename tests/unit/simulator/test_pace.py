"""How fast vehicle time runs is measured: a machine that cannot keep up says so instead of slipping in silence."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from app.simulator.clock import VehicleClock
from app.simulator.pace import MAX_BEHIND_S, Pace, PaceWatch
from tests.support.paced import Machine


@pytest.mark.parametrize("speed", [1.0, 4.0, 50.0])
def test_a_machine_that_keeps_up_runs_at_the_speed_that_was_asked_for(speed: float) -> None:
    machine = Machine(speed).run(20.0)
    report = machine.pace.report()
    assert machine.steps * VehicleClock.STEP_S == pytest.approx(20.0 * speed, rel=0.01)
    assert report.achieved == pytest.approx(speed, rel=0.01)
    assert (report.wanted, report.behind, report.lost_s) == (speed, False, 0.0)


def test_the_speed_is_not_known_in_the_first_second() -> None:
    assert Pace(1.0, lambda: 0.0).report().achieved is None
    assert Machine(10.0).run(0.5).pace.report().achieved is None


def test_a_machine_that_cannot_keep_up_says_how_fast_it_is_and_what_it_gave_up() -> None:
    machine = Machine(50.0)
    machine.step_cost_s = 0.001  # 1000 steps a second are 20x
    report = machine.run(20.0).pace.report()
    assert report.achieved == pytest.approx(20.0, rel=0.02)
    assert report.behind
    assert report.lost_s == pytest.approx(20.0 * (1.0 - 20.0 / 50.0), rel=0.05)
    assert report.latest_s == pytest.approx(MAX_BEHIND_S, abs=0.01)


def test_it_is_behind_until_it_has_caught_up() -> None:
    machine = Machine(10.0)
    machine.step_cost_s = 0.01
    assert machine.run(10.0).pace.report().behind
    machine.step_cost_s = 0.0
    report = machine.run(10.0).pace.report()
    assert not report.behind
    assert report.lost_s > 1.0, "what was lost stays lost"


def test_a_machine_that_slept_does_not_make_the_vehicles_leap() -> None:
    machine = Machine(4.0).run(10.0)
    before = machine.steps
    machine.wall_s += 3600.0
    machine.run(0.1)
    assert (machine.steps - before) * VehicleClock.STEP_S < 4.0 * (MAX_BEHIND_S + 0.2)
    assert machine.pace.report().lost_s == pytest.approx(3600.0, abs=1.0)


def test_a_short_hiccup_is_caught_up_with_and_is_no_warning() -> None:
    machine = Machine(4.0).run(10.0)
    with _said_by(machine) as said:
        machine.wall_s += 0.2
        machine.run(1.0)
    assert machine.pace.report().lost_s == 0.0
    assert said == []


def test_the_warning_comes_once_and_names_the_speed_that_is_kept_then_the_end_is_said() -> None:
    machine = Machine(50.0)
    machine.step_cost_s = 0.001
    with _said_by(machine) as said:
        machine.run(10.0)
        machine.step_cost_s = 0.0
        machine.run(10.0)
    assert len(said) == 2
    assert said[0].startswith("warning: this machine cannot keep 50x: the vehicles' time runs 2")
    assert said[1] == "the vehicles' time runs 50x again"


@contextmanager
def _said_by(machine: Machine) -> Iterator[list[str]]:
    """What the watch says while the machine runs, looked at each second."""
    said: list[str] = []
    watch = PaceWatch(machine.pace, said.append)
    run = machine.run

    def watched(seconds: float) -> Machine:
        for _ in range(max(1, round(seconds))):
            run(min(1.0, seconds))
            watch.look()
        return machine

    machine.run = watched  # type: ignore[method-assign]
    yield said
