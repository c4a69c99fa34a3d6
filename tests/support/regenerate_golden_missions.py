"""Writes what is generated from the domain anew: `python -m tests.support.regenerate_golden_missions`.

Golden missions, docs/reference/{rules,reasons,offboard}.md, the page's words of reasons and its item types.

Read the difference.
"""

from __future__ import annotations

from tests.support.golden_mission import (
    GOLDEN,
    ITEM_TYPES_OF_PAGE,
    OFFBOARD_PAGE,
    PLANS,
    REASON_WORDS,
    REASONS_PAGE,
    RULES_PAGE,
    golden_path,
    golden_text,
)
from tools.reference import item_types, reason_words, reasons_page, rules_page, with_tables


def main() -> None:
    GOLDEN.mkdir(parents=True, exist_ok=True)
    for plan in PLANS:
        golden_path(plan).write_text(golden_text(plan), encoding="utf-8")
    RULES_PAGE.write_text(rules_page(), encoding="utf-8")
    REASONS_PAGE.write_text(reasons_page(), encoding="utf-8")
    ITEM_TYPES_OF_PAGE.write_text(item_types(), encoding="utf-8")
    REASON_WORDS.write_text(reason_words(), encoding="utf-8")
    OFFBOARD_PAGE.write_text(with_tables(OFFBOARD_PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
