"""A verification holds all runs of a journal at once: those that are over take little memory, and lose nothing."""

from __future__ import annotations

import gc
import tracemalloc
from itertools import pairwise

from app.domain.drop.record import DropOutcome
from app.domain.events.run import RunChanged, RunCreated, RunDrop
from app.domain.run.run import Run, RunState
from app.storage.run_folds import RunFolds
from tests.support.stored_samples import run


def over(number: int) -> Run:
    return run(number).model_copy(update={"state": RunState.COMPLETED, "ended_at": 2000.0})


def flown(folds: RunFolds, *numbers: int) -> None:
    for number in numbers:
        for payload in (RunCreated(run(number)), RunChanged(over(number))):
            folds.take(f"run-{number}", type(payload).model_validate_json(payload.model_dump_json()))


def test_a_run_that_is_over_takes_little_memory() -> None:
    folds = RunFolds()
    tracemalloc.start()
    try:
        taken = []
        for first, last in pairwise((0, 50, 550)):
            flown(folds, *range(first, last))
            gc.collect()
            taken.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert (taken[1] - taken[0]) / 500 < 2000, "bytes for each"


def test_a_run_that_is_over_is_as_its_events_left_it_and_can_be_changed_again() -> None:
    folds = RunFolds()
    flown(folds, 1, 2)
    assert (folds.get("run-1").run(), folds.run_ids, folds.plan_ids) == (over(1), ["run-1", "run-2"], {"plan-1"})
    drop = over(1).drops[0].model_copy(update={"outcome": DropOutcome.RELEASED})
    folds.take("run-1", RunDrop(drop))
    changed = folds.get("run-1").run()
    assert changed is not None
    assert changed.drops[0] == drop
    assert not folds.get("run-1").knows_when


def test_a_run_without_events_is_none() -> None:
    assert RunFolds().get("run-1").run() is None
