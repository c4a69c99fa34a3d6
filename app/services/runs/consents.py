"""Operators' answers to what the drops of one flight ask: the first one in time counts, and no other."""

from __future__ import annotations

from app.domain.consent import Answer, ConsentRecord, is_new_answer
from app.domain.errors import ConsentNotAskedError, ConsentTooLateError, NotFoundError
from app.domain.flight.inputs import ConsentAnswered
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.run import Run
from app.services.runs.recorder import RunRecorder
from app.services.runs.watch import FlightWatch


class Consents:
    """Takes the answers of one flight. It sends nothing: the drop does what follows at its next look, checked anew."""

    def __init__(self, watch: FlightWatch, recorder: RunRecorder) -> None:
        self._watch = watch
        self._recorder = recorder

    async def answer(self, plan_item_id: str, answer: Answer, by: str) -> Run:
        """Count an answer, or find that the same one counted already; stored when this returns.

        Raises:
            NotFoundError, ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError.
            StorageError: it counts, and is stored later; no release is sent before that.
        """
        refuse_unknown(self._recorder.run, plan_item_id)
        consent = self._consent(plan_item_id)
        if is_new_answer(consent, answer):
            self._watch.feed(ConsentAnswered(self._watch.sight(), plan_item_id, answer, by))
            if self._consent(plan_item_id) == consent:
                raise ConsentTooLateError("the time to answer is over: that counts as a refusal")
        return await self._recorder.flush()

    def _consent(self, plan_item_id: str) -> ConsentRecord | None:
        release = self._watch.flight.leg.find(plan_item_id)
        return release.record.consent if isinstance(release, SupervisedRelease) else None


def without_flight(run: Run, plan_item_id: str, answer: Answer) -> Run:
    """The same for a run that nobody follows now: no answer can count any more, but one may have counted.

    Raises:
        NotFoundError, ConsentNotAskedError, ConsentTooLateError, ConsentAnsweredError.
    """
    refuse_unknown(run, plan_item_id)
    if is_new_answer(run.drop(plan_item_id).consent, answer):
        raise ConsentNotAskedError("Waydrop restarted and has not found the vehicle yet: what it asked does not count")
    return run


def refuse_unknown(run: Run, plan_item_id: str) -> None:
    """Raises NotFoundError if the run has no such drop."""
    if all(drop.plan_item_id != plan_item_id for drop in run.drops):
        raise NotFoundError(f"run {run.id} has no drop {plan_item_id!r}", hint="GET the run: its drops are listed")
