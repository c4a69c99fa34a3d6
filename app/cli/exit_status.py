"""What the exit status of every waydrop command means."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from app.domain.errors import WaydropError


class ExitStatus(IntEnum):
    """Documented in docs/deployment.md; scripts decide by these."""

    OK = 0
    NOT_ACHIEVED = 1
    """The plan has errors, a drop was not released, the run did not complete, or the service could not start."""
    UNUSABLE = 2
    """The file, an option or a setting cannot be used. Nothing was asked of a vehicle."""
    UNREACHABLE = 3
    """No Waydrop answers at the server's address, or it stayed away while a run was followed."""
    REFUSED = 4
    """Waydrop answered with a refusal: no access, not found, busy, wrong state."""
    INTERRUPTED = 130
    """Ctrl-C. A flight that was only followed goes on."""


_BY_CODE: Final = {
    "settings.invalid": ExitStatus.UNUSABLE,
    "plan.invalid": ExitStatus.UNUSABLE,
    "input.invalid": ExitStatus.UNUSABLE,
    "conversion.refused": ExitStatus.UNUSABLE,
    "plan.rejected": ExitStatus.NOT_ACHIEVED,
    "drop.consent_not_asked": ExitStatus.REFUSED,
    "server.unreachable": ExitStatus.UNREACHABLE,
    "storage.failed": ExitStatus.NOT_ACHIEVED,
}


class ServerUnreachableError(WaydropError):
    """No Waydrop answers at this address."""

    code = "server.unreachable"


class ServerRefusedError(WaydropError):
    """Waydrop answered with problem+json. `code` is the problem's; `status` its HTTP status."""

    def __init__(self, code: str, detail: str, *, status: int, hint: str = "", **extra: object) -> None:
        super().__init__(detail, hint=hint, **extra)
        self.code = code
        self.status = status


def status_of(error: WaydropError) -> ExitStatus:
    """The exit status that an error ends a command with."""
    known = _BY_CODE.get(error.code)
    if known is not None:
        return known
    return ExitStatus.REFUSED if isinstance(error, ServerRefusedError) else ExitStatus.NOT_ACHIEVED
