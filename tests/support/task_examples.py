"""Tasks of every type, and the vehicle that they are for."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st
from pydantic import TypeAdapter

from app.domain.offboard.tasks.course import EkfOrigin
from app.domain.offboard.tasks.forms import Task

_TASK: TypeAdapter[Task] = TypeAdapter(Task)
ORIGIN = EkfOrigin(47.397742, 8.545594, 488.0)
HERE: dict[str, Any] = {"east_m": 10.0, "north_m": 20.0}
THERE: dict[str, Any] = {"east_m": 10.0, "north_m": 80.0}
EXAMPLES: dict[str, dict[str, Any]] = {
    "goto": {"point": HERE},
    "circle": {"center": HERE, "radius_m": -25.0},
    "segment": {"start": HERE, "end": THERE},
    "path": {"points": [HERE, THERE, {"east_m": 60.0, "north_m": 80.0}]},
}


def task_of(document: dict[str, Any]) -> Task:
    """The task of a JSON document. Raises ValidationError."""
    read: Task = _TASK.validate_python(document)
    return read


def task(kind: str, **changes: Any) -> Task:
    """The example of a type, changed."""
    return task_of({"type": kind, **EXAMPLES[kind], **changes})


def tasks() -> st.SearchStrategy[Task]:
    """Any example with any duration."""
    durations = st.one_of(st.floats(-10.0, 0.0), st.floats(0.5, 30.0))
    return st.builds(lambda kind, s: task(kind, duration_s=s), st.sampled_from(sorted(EXAMPLES)), durations)
