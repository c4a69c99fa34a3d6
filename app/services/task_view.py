"""What the outside is shown of a vehicle's task queue."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from app.domain.tasks.forms import Task, WhenEmpty
from app.domain.tasks.origin import EkfOrigin
from app.services.offboard_view import FlownBy, TaskReport


class OriginView(BaseModel):
    """The EKF origin, from which local east and north count: degrees, metres AMSL. It is not home, which moves."""

    model_config = ConfigDict(frozen=True)

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    @classmethod
    def of(cls, origin: EkfOrigin) -> OriginView:
        """To a millimetre or so: it is reckoned back from home."""
        place = round(origin.latitude_deg, 8), round(origin.longitude_deg, 8)
        return cls(latitude_deg=place[0], longitude_deg=place[1], altitude_m=round(origin.altitude_m, 3))


class QueuedTaskView(BaseModel):
    """One task. `remaining_s` is -1 without a limit. Of the current one also how far it is, null before it is flown.

    `cross_m`: metres beside its course, to the right positive. `left_m`: to its end, null where it has none. `leg`: of
    a path, counted from 0.
    """

    model_config = ConfigDict(frozen=True)

    id: str
    task: Task
    remaining_s: float
    leg: int
    cross_m: float | None
    left_m: float | None


class TasksView(BaseModel):
    """The queue of one vehicle, current task first. `origin` null: the vehicle has not told it yet.

    `flown_by`: how its tasks are flown; null: not at all, or its type is not known.
    """

    model_config = ConfigDict(frozen=True)

    report: TaskReport
    origin: OriginView | None
    when_empty: WhenEmpty
    flown_by: FlownBy | None = None
    capacity: int
    tasks: list[QueuedTaskView]
