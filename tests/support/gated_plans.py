"""A run is refused for a vehicle whose battery would not last: as it is made, and again as it is started."""

from __future__ import annotations

from app.domain.errors import PlanRejectedError


def codes(error: PlanRejectedError) -> set[str]:
    return {finding["code"] for finding in error.extra["findings"] if finding["severity"] == "error"}
