"""The task queues of the fleet: kept for the holder of the offboard lease, flown by setpoints."""

from app.services.tasks.queue_service import TaskQueueService, Tasks

__all__ = ["TaskQueueService", "Tasks"]
