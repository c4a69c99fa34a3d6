"""Writes the golden missions and docs/rules.md anew: `python -m tests.unit.domain.regenerate`. Read the difference."""

from __future__ import annotations

from app.domain.rules.document import rules_page
from tests.unit.domain.golden_mission import GOLDEN, PLANS, RULES_PAGE, golden_path, golden_text


def main() -> None:
    GOLDEN.mkdir(parents=True, exist_ok=True)
    for plan in PLANS:
        golden_path(plan).write_text(golden_text(plan), encoding="utf-8")
    RULES_PAGE.write_text(rules_page(), encoding="utf-8")


if __name__ == "__main__":
    main()
