"""A command is over once: by its first final ack or by its last deadline. IN_PROGRESS gives it more time."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.domain.mission import NAN, MavCmd
from app.domain.vehicle.commands import CommandAck, CommandRequest, MavResult, PendingCommand

REQUEST = CommandRequest(
    MavCmd.DO_GRIPPER, (1.0, 0.0, NAN, NAN, NAN, NAN, NAN), timeout_s=1.0, attempts=3, in_progress_timeout_s=10.0
)


def ack(result: int) -> CommandAck:
    return CommandAck(MavCmd.DO_GRIPPER, result)


def test_without_any_ack_it_is_sent_as_often_as_allowed_and_then_times_out() -> None:
    pending = PendingCommand.sent(REQUEST, 0.0)
    sends = 1
    for tenth in range(60):
        pending, again = pending.ticked(tenth / 10)
        sends += again
    assert sends == REQUEST.attempts
    assert pending.timed_out


def test_in_progress_extends_the_deadline_and_forbids_sending_again() -> None:
    pending = PendingCommand.sent(REQUEST, 0.0).acked(ack(MavResult.IN_PROGRESS), 0.5)
    pending, again = pending.ticked(9.0)
    assert not again
    assert not pending.is_over
    pending, again = pending.ticked(10.6)
    assert not again
    assert pending.timed_out


def test_an_unknown_result_is_kept_raw_and_final() -> None:
    pending = PendingCommand.sent(REQUEST, 0.0).acked(ack(77), 0.1)
    assert pending.is_over
    assert pending.final is not None
    assert pending.final.word == "MAV_RESULT 77"


def test_an_ack_of_another_command_is_not_ours() -> None:
    pending = PendingCommand.sent(REQUEST, 0.0).acked(CommandAck(MavCmd.COMPONENT_ARM_DISARM, 0), 0.1)
    assert not pending.is_over


@given(st.lists(st.one_of(st.integers(0, 9), st.floats(0, 30, allow_nan=False))))
def test_once_over_nothing_changes_it(steps: list[int | float]) -> None:
    pending, now_s = PendingCommand.sent(REQUEST, 0.0), 0.0
    for step in steps:
        was_over, before = pending.is_over, pending
        if isinstance(step, int):
            pending, again = pending.acked(ack(step), now_s), False
        else:
            now_s += step
            pending, again = pending.ticked(now_s)
        assert pending.sends <= REQUEST.attempts
        if was_over:
            assert pending == before
            assert not again
