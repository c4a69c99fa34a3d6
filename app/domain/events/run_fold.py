"""A run rebuilt from its events, which the hash chain covers, independent of the table of runs."""

from __future__ import annotations

from typing import Final

from app.domain.drop.record import DropRecord
from app.domain.events import AnyPayload, EventKind, RunPayload
from app.domain.events import run as events
from app.domain.run.run import Run

WHOLE_RUN: Final = (EventKind.RUN_CREATED, EventKind.RUN_CHANGED, EventKind.RUN_CONTINUED, EventKind.RUN_TAKEN_OVER)
"""Events that have the whole run: the newest of them and the drops after it make a run."""


class RunFold:
    """Applies the events of a run in order."""

    def __init__(self) -> None:
        self._run: Run | None = None
        self._drops: dict[str, DropRecord] = {}

    @property
    def knows_when(self) -> bool:
        """Whether the newest event includes `updated_at`. Drop events do not."""
        return not self._drops

    def take(self, payload: AnyPayload) -> None:
        """Apply an event."""
        if not isinstance(payload, RunPayload):
            return
        match payload:
            case (
                events.RunCreated(root=run)
                | events.RunChanged(root=run)
                | events.RunContinued(root=run)
                | events.RunTakenOver(root=run)
            ):
                if self._run is None or run.handovers >= self._run.handovers:
                    self._run, self._drops = run, {}
            case events.RunDrop(root=drop):
                self._drops[drop.plan_item_id] = drop
            case events.RunUploadProgress(percent=percent):
                if self._run is not None:
                    self._run = self._run.model_copy(update={"upload_percent": percent})
            case (
                events.RunPredicted()
                | events.RunPlanRefused()
                | events.RunMissionChanged()
                | events.RunTargetMoved()
                | events.RunTargetNotFollowed()
                | events.RunItem()
                | events.RunItemEnded()
                | events.RunCommand()
                | events.RunAck()
                | events.RunAttachment()
                | events.DropConsentAsked()
                | events.DropConsentClosed()
            ):
                pass  # their changes of the run are also in a run.changed

    def run(self) -> Run | None:
        """The run after the newest event; None without events."""
        if self._run is None or not self._drops:
            return self._run
        drops = tuple(self._drops.get(drop.plan_item_id, drop) for drop in self._run.drops)
        return self._run.model_copy(update={"drops": drops})
