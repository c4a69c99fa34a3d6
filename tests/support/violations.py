"""How a law of the architecture fails: with everything that breaks it, a line each."""

from __future__ import annotations

import pytest


def held(violations: list[str]) -> None:
    """Fail with every violation on a line of its own."""
    if violations:
        pytest.fail("\n" + "\n".join(violations), pytrace=False)
