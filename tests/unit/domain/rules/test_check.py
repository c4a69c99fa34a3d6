"""A check keeps nothing of its plan: all is freed as it returns, not when the collector comes by."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path

import pytest

from app.domain.plan import parse_plan
from app.domain.rules import checked
from tests.support.paths import ROOT

PLANS = sorted((ROOT / "plans").glob("*.json"))


@pytest.mark.parametrize("file", PLANS, ids=lambda file: file.stem)
def test_what_a_check_looked_at_is_freed_without_the_garbage_collector(file: Path) -> None:
    """A plan of 990 items would leave 30,000 objects until then, and the collector would stop the event loop."""
    plan = parse_plan(file.read_bytes())
    seen = weakref.ref(plan)
    gc.disable()
    try:
        checked(plan, None)
        del plan
        assert seen() is None, "the check left a cycle of references to the plan"
    finally:
        gc.enable()
