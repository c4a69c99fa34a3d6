"""docs/how-to/queue-jobs.md names every state, every code and every number as the code has them."""

from __future__ import annotations

import re

from app.domain.jobs.assignment import NEAR_M
from app.domain.jobs.job import JobState, VehicleRefusal
from app.domain.jobs.queue import MAX_WAITING
from app.domain.rules.vehicle import MAX_HOME_OFFSET_M
from app.services.jobs.views import LEAST_BATTERY_PERCENT, JobRequest
from tests.support.paths import ROOT

PAGE = (ROOT / "docs" / "how-to" / "queue-jobs.md").read_text(encoding="utf-8")


def rows(pattern: str) -> list[str]:
    return re.findall(rf"^\| `({pattern})` \|", PAGE, re.MULTILINE)


def test_every_state_code_and_field_is_in_its_table_and_no_other() -> None:
    assert sorted(rows(r"vehicle\.\w+")) == sorted(VehicleRefusal)
    assert sorted(rows(r"[a-z_]+")) == sorted([*JobRequest.model_fields, *JobState])


def test_the_numbers_of_the_page_are_those_of_the_code() -> None:
    assert f"At most {MAX_WAITING} jobs wait" in PAGE
    assert f"within {NEAR_M:g} m" in PAGE
    assert f"more than {MAX_HOME_OFFSET_M:g} m" in PAGE
    assert f"{LEAST_BATTERY_PERCENT:g} without it" in PAGE
