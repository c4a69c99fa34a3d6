"""Reports of moving targets, shared: API nodes take them, and every gateway that follows a target hears them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import structlog
from pydantic import BaseModel, ValidationError

from app.domain.cluster.ports import Bus
from app.domain.errors import ConflictError, InvalidInputError
from app.domain.targets import TargetFix, TargetReport
from app.services.clock import Clock
from app.services.targets import Targets

log = structlog.get_logger(__name__)

TARGETS_SUBJECT: Final = "waydrop.targets"
LOG_EACH_S: Final = 60.0
"""While reports are dropped, the log says so this often: some targets report many times a second."""


class _Shared(BaseModel):
    feed: str
    report: TargetReport


class SharedReports:
    """Hears the reports that API nodes took, and adds them to the targets of this process."""

    def __init__(self, take: Callable[[str, TargetReport], object], clock: Clock) -> None:
        self._take = take
        self._clock = clock
        self._log_again_s = 0.0

    def hear(self, message: bytes) -> None:
        """Add a report that another node took. One that is older than the known one is dropped.

        One that is ahead of this clock, or that cannot be read, is dropped and logged: nobody else notices that this
        process does not follow the target.
        """
        try:
            shared = _Shared.model_validate_json(message)
        except ValidationError:
            self._tell("a report of a target cannot be read: API nodes have another version than this process")
            return
        try:
            self._take(shared.feed, shared.report)
        except InvalidInputError as error:
            self._tell("a report of a target is dropped", feed=shared.feed, error=error.detail, hint=error.hint)
        except ConflictError:
            return

    def _tell(self, what: str, **about: object) -> None:
        now_s = self._clock.monotonic()
        if now_s >= self._log_again_s:
            self._log_again_s = now_s + LOG_EACH_S
            log.warning(what, **about)


class SharedTargets(Targets):
    """Targets whose reports are told to all others, also to this node."""

    def __init__(self, clock: Clock, bus: Bus) -> None:
        super().__init__(clock)
        self._bus = bus

    async def accept(self, feed: str, report: TargetReport) -> TargetFix:
        """See Targets. Raises BusDownError: no gateway has the report, nor has this node."""
        self.checked_age_s(feed, report)
        await self._bus.publish(TARGETS_SUBJECT, _Shared(feed=feed, report=report).model_dump_json().encode())
        return self.report(feed, report)
