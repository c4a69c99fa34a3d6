"""Open files: each connection is one, and without any the journal cannot be written and nobody gets in."""

from __future__ import annotations

import resource
from typing import Final

from app.config import PREFIX, SettingsError

RESERVED: Final = 512
"""For the journal, attachments, vehicles, webhooks and the libraries."""


def require_files(connections: int) -> None:
    """Raise the soft limit to what so many connections need. Raises SettingsError if the hard one forbids it."""
    needed = connections + RESERVED
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if _reaches(soft, needed):
        return
    if not _reaches(hard, needed):
        raise SettingsError(
            f"{PREFIX}MAX_CONNECTIONS: {connections} connections need {needed} open files, and {hard} are allowed",
            hint=f"raise the limit (ulimit -Hn, LimitNOFILE, ulimits), or set {PREFIX}MAX_CONNECTIONS lower",
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))


def _reaches(limit: int, needed: int) -> bool:
    return limit == resource.RLIM_INFINITY or limit >= needed
