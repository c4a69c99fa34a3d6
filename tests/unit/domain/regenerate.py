"""Writes golden missions, docs/rules.md and docs/offboard.md anew: `python -m tests.unit.domain.regenerate`.

Read the difference.
"""

from __future__ import annotations

from app.domain.rules.document import rules_page
from app.domain.setpoint.document import with_tables
from tests.unit.domain.golden_mission import GOLDEN, OFFBOARD_PAGE, PLANS, RULES_PAGE, golden_path, golden_text


def main() -> None:
    GOLDEN.mkdir(parents=True, exist_ok=True)
    for plan in PLANS:
        golden_path(plan).write_text(golden_text(plan), encoding="utf-8")
    RULES_PAGE.write_text(rules_page(), encoding="utf-8")
    OFFBOARD_PAGE.write_text(with_tables(OFFBOARD_PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
