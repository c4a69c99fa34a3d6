"""Logs: one line for each event on stderr, as JSON for machines or coloured for people."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable
from typing import Final, TextIO

import structlog
from structlog.typing import EventDict, Processor

from app.config import Settings
from app.domain.text import one_line

MOST_ALIKE: Final = 10
ALIKE_FOR_S: Final = 10.0
"""So many lines of one kind in so long are written of a library; it may say the same without end."""

KINDS_KEPT: Final = 256


class ForeignThrottle(logging.Filter):
    """Bounds what libraries say. Our own lines are left alone: they are bounded where they are written."""

    def __init__(self, monotonic: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._monotonic = monotonic
        self._said: dict[tuple[str, str], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether the line is written; the first after a while says how many were not."""
        if record.name == "app" or record.name.startswith("app."):
            return True
        kind, now_s = (record.name, str(record.msg)), self._monotonic()
        since_s, count = self._said.pop(kind, (now_s, 0))
        if now_s - since_s >= ALIKE_FOR_S:
            if count > MOST_ALIKE:
                record.msg = f"{record.msg} ({count - MOST_ALIKE} similar messages omitted)"
            since_s, count = now_s, 0
        self._said[kind] = (since_s, count + 1)
        if len(self._said) > KINDS_KEPT:
            del self._said[next(iter(self._said))]
        return count < MOST_ALIKE


def _one_line_each(_logger: object, _method: str, event: EventDict) -> EventDict:
    """What vehicles and clients say must neither steer the terminal nor look like a line of its own."""
    return {name: one_line(value) if isinstance(value, str) else value for name, value in event.items()}


def configure_logs(settings: Settings, stream: TextIO | None = None) -> None:
    """Send structlog's and the standard library's logs through one formatter. `auto`: people if it is a terminal."""
    stream = stream or sys.stderr
    for_people = settings.log_format == "console" or (settings.log_format == "auto" and stream.isatty())
    shared: list[Processor] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="%H:%M:%S" if for_people else "iso", utc=not for_people),
        _one_line_each,
    ]
    last: list[Processor] = (
        [structlog.dev.ConsoleRenderer(colors=stream.isatty())]
        if for_people
        else [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]
    )
    structlog.configure(
        processors=[
            structlog.stdlib.filter_by_level,
            *shared,
            structlog.processors.StackInfoRenderer(),
            structlog.stdlib.ProcessorFormatter.wrap_for_formatter,
        ],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=False,
    )
    handler = logging.StreamHandler(stream)
    formatter = structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=shared, processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *last]
    )
    handler.setFormatter(formatter)
    handler.addFilter(ForeignThrottle())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(settings.log_level.upper())
    for chatty in ("alembic", "aiohttp.access", "sqlalchemy"):
        logging.getLogger(chatty).setLevel(max(logging.WARNING, root.level))
