"""The page has the service's own list of item types."""

from __future__ import annotations

from tests.support.golden_mission import ITEM_TYPES_OF_PAGE
from tools.reference import item_types


def test_the_page_has_the_item_types_of_the_service() -> None:
    promise = "run `python -m tests.support.regenerate_golden_missions` and read the difference"
    assert ITEM_TYPES_OF_PAGE.read_text(encoding="utf-8") == item_types(), promise
