"""The runs of a whole journal, rebuilt from their events in bounded memory."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

from app.domain.events import RunPayload
from app.domain.events.run import RunChanged
from app.domain.events.run_fold import RunFold
from app.domain.run.run import Run


class RunFolds:
    """One for each run. Those that are over, which are most, are kept packed: a Run takes 10 KB."""

    def __init__(self) -> None:
        self._open: dict[str, RunFold] = {}
        self._over: dict[str, bytes] = {}
        self._plans: dict[str, str] = {}

    def take(self, run_id: str, payload: RunPayload) -> None:
        """Apply an event of a run."""
        fold = self._open.pop(run_id, None) or self._unpacked(run_id)
        self._over.pop(run_id, None)
        fold.take(payload)
        run = fold.run()
        if run is not None:
            self._plans[run_id] = run.plan_id
        if run is not None and run.is_over and fold.knows_when:  # else the drops after it are not in it
            self._over[run_id] = zlib.compress(run.model_dump_json().encode(), 1)
        else:
            self._open[run_id] = fold

    def get(self, run_id: str) -> RunFold:
        """The fold of a run; one without events if it is unknown."""
        return self._open.get(run_id) or self._unpacked(run_id)

    @property
    def run_ids(self) -> Sequence[str]:
        """Those of which a whole run is known."""
        return list(self._plans)

    @property
    def plan_ids(self) -> set[str]:
        """The plans of these runs."""
        return set(self._plans.values())

    def _unpacked(self, run_id: str) -> RunFold:
        fold = RunFold()
        if (packed := self._over.get(run_id)) is not None:
            fold.take(RunChanged(Run.model_validate_json(zlib.decompress(packed))))
        return fold
