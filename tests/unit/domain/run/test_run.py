"""A run moves only along its table, and an end is an end."""

from __future__ import annotations

import pytest

from app.domain.errors import WrongStateError
from app.domain.run.run import NEXT, TERMINAL, Run, RunState


def run_in(state: RunState) -> Run:
    return Run(id="r", plan_id="p", plan_hash="h", vehicle_id="v1", state=state, created_at=0, updated_at=0)


@pytest.mark.parametrize("state", RunState)
@pytest.mark.parametrize("following", RunState)
def test_only_the_table_allows_a_move(state: RunState, following: RunState) -> None:
    if following in NEXT[state]:
        assert run_in(state).moved_to(following, now=1.0).state is following
    else:
        with pytest.raises(WrongStateError):
            run_in(state).moved_to(following, now=1.0)


@pytest.mark.parametrize("state", sorted(TERMINAL))
def test_nothing_follows_an_end(state: RunState) -> None:
    assert not NEXT[state]
    assert run_in(state).is_over


def test_every_state_that_is_no_end_can_end() -> None:
    for state in RunState:
        if state not in TERMINAL:
            assert NEXT[state] & TERMINAL, f"a run could hang in {state}"


def test_times_are_kept_at_take_off_and_end() -> None:
    flying = run_in(RunState.STARTING).moved_to(RunState.FLYING, now=5.0)
    assert flying.started_at == 5.0
    ended = flying.moved_to(RunState.LANDED, now=8.0).moved_to(RunState.COMPLETED, now=9.0)
    assert (ended.started_at, ended.ended_at) == (5.0, 9.0)
