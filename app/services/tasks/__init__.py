"""The task queues of the fleet: kept for the holder of the offboard lease, flown by setpoints."""

from app.services.tasks.desk import TaskDesk
from app.services.tasks.tasks import Tasks

__all__ = ["TaskDesk", "Tasks"]
