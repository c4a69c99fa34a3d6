"""How a supervised drop ends: its outcome, how sure that is, and whether the mission is moved on."""

from __future__ import annotations

from dataclasses import replace

from app.domain.drop import Certainty, DropOutcome, DropPhase
from app.domain.reason import Reason, ReasonCode, because
from app.domain.supervised.checks import is_holding
from app.domain.supervised.inputs import Divert, DropEffect, Finish, Observation, Resume, RunEnding, output_of
from app.domain.supervised.state import DropMachine
from app.domain.supervised.terms import GRIPPER_CLOSED_US

Effects = tuple[DropEffect, ...]


def conclude(drop: DropMachine, seen: Observation | None, reason: Reason) -> tuple[DropMachine, Effects]:
    """Close a drop that was not accepted: with what was commanded, if anything was, and what the output shows."""
    if drop.opened:
        outcome, certainty = DropOutcome.RELEASED, Certainty.INFERRED
        reason = because(ReasonCode.DROP_BUT_RELEASED, reason)
    elif output_of(seen) == GRIPPER_CLOSED_US and seen is not None and seen.connected:
        outcome, certainty = DropOutcome.KEPT, Certainty.INFERRED
        reason = because(ReasonCode.DROP_STILL_AT_GRAB, reason)
    elif drop.unsure:
        outcome, certainty = DropOutcome.UNKNOWN, Certainty.NONE
    else:
        outcome, certainty = DropOutcome.KEPT, _certainty_kept(drop)
    return finish_and_resume(drop, seen, outcome, certainty, reason)


def ended(drop: DropMachine, heard: RunEnding) -> tuple[DropMachine, Effects]:
    """Close a drop with its run."""
    if not drop.attempts:
        return finish(drop, DropOutcome.KEPT, Certainty.INFERRED, heard.reason)
    if drop.accepted_at_s is not None:
        reason = because(ReasonCode.DROP_ACKNOWLEDGED_THEN, heard.reason)
        return finish(drop, DropOutcome.RELEASED, Certainty.ACKNOWLEDGED, reason)
    if drop.opened:
        reason = because(ReasonCode.DROP_ACK_MISSING_RELEASED_THEN, heard.reason)
        return finish(drop, DropOutcome.RELEASED, Certainty.INFERRED, reason)
    if drop.in_flight is not None or drop.unsure:
        return finish(drop, DropOutcome.UNKNOWN, Certainty.NONE, heard.reason)
    return finish(drop, DropOutcome.KEPT, _certainty_kept(drop), heard.reason)


def _certainty_kept(drop: DropMachine) -> Certainty:
    """A refusal is an acknowledgement; a release that was never sent has none."""
    return Certainty.INFERRED if drop.withheld == drop.attempts else Certainty.ACKNOWLEDGED


def finish(
    drop: DropMachine, outcome: DropOutcome, certainty: Certainty, reason: Reason
) -> tuple[DropMachine, tuple[Finish]]:
    """The drop is over; the mission goes on by itself."""
    consent = drop.consent.withdrawn(at_end=True)
    return replace(drop, phase=DropPhase.DONE, in_flight=None, consent=consent), (Finish(outcome, certainty, reason),)


def finish_and_resume(
    drop: DropMachine, seen: Observation | None, outcome: DropOutcome, certainty: Certainty, reason: Reason
) -> tuple[DropMachine, Effects]:
    """Finish, and move on only if the mission surely waits at this drop for as long as that may take: somebody else's
    choice is never undone, and an item that the mission has gone on to by itself is never flown to again. To the
    alternate, if there is one and the parcel is surely on board: every release that was sent was refused.
    """
    drop, finished = finish(drop, outcome, certainty, reason)
    if seen is None or not still_waits(drop, seen, drop.terms.resume_s):
        return drop, finished
    if drop.terms.alternate_seq is not None and outcome is DropOutcome.KEPT and not drop.unsure:
        return drop, (*finished, Divert(drop.terms.alternate_seq))
    return drop, (*finished, Resume(drop.terms.resume_seq))


def still_waits(drop: DropMachine, seen: Observation, needed_s: float) -> bool:
    """Whether the vehicle is seen to wait at this drop, and surely does for so long."""
    waits = seen.connected and is_holding(seen, drop.terms)
    return waits and drop.hold.waits_longer_than(needed_s, seen, drop.terms)
