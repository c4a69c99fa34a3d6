"""What of a task can be mended before its turn, and what stays."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from app.domain.errors import TaskRefusedError
from app.domain.offboard.tasks.forms import Circle, Task, TaskTerms
from tests.support.task_examples import EXAMPLES, task


def mended(one: Task, **terms: Any) -> dict[str, Any]:
    """What is another after it."""
    before, after = one.model_dump(), TaskTerms.model_validate(terms).applied(one).model_dump()
    return {name: value for name, value in after.items() if value != before[name]}


@pytest.mark.parametrize("kind", sorted(EXAMPLES))
def test_only_what_is_given_changes(kind: str) -> None:
    one = task(kind, duration_s=30.0, speed_m_s=4.0, relative_altitude_m=20.0)
    assert mended(one, duration_s=45.0) == {"duration_s": 45.0}
    assert mended(one, duration_s=30.0) == {}
    assert mended(one, speed_m_s=None, duration_s=-1) == {"speed_m_s": None, "duration_s": -1.0}


def test_an_altitude_takes_the_place_of_the_one_there_was() -> None:
    one = task("goto", relative_altitude_m=20.0)
    assert mended(one, absolute_altitude_m=520.0) == {"relative_altitude_m": None, "absolute_altitude_m": 520.0}
    assert mended(one, relative_altitude_m=None) == {"relative_altitude_m": None}
    assert mended(one, absolute_altitude_m=None) == {"relative_altitude_m": None}, "as high as it is then"


def test_a_circle_has_a_radius_and_nothing_else_has() -> None:
    circle = task("circle")
    assert mended(circle, radius_m=40.0) == {"radius_m": 40.0}
    assert isinstance(circle, Circle)
    assert mended(circle, radius_m=None, duration_s=9.0) == {"duration_s": 9.0}, "null: as it is"
    with pytest.raises(TaskRefusedError) as refused:
        mended(task("goto"), radius_m=40.0)
    assert refused.value.refusal == "task.no_radius"


@pytest.mark.parametrize(
    "terms",
    [
        {},
        {"radius_m": None},
        {"relative_altitude_m": 1.0, "absolute_altitude_m": 2.0},
        {"radius_m": 0.5},
        {"duration_s": None},
        {"speed_m_s": 0.0},
        {"point": {"east_m": 0.0, "north_m": 0.0}},
    ],
)
def test_what_says_nothing_or_nonsense_is_no_change(terms: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        TaskTerms.model_validate(terms)
