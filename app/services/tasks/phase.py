"""What is done with a task queue, and the words in which it is told."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from app.services.offboard_view import TaskState


class Phase(StrEnum):
    """What is done with the queue."""

    IDLE = "idle"
    FLYING = "flying"
    PAUSED = "paused"
    BY_HAND = "by_hand"
    ENDING = "ending"


WORDS: Final[Mapping[Phase, TaskState]] = {
    Phase.IDLE: "idle",
    Phase.PAUSED: "paused",
    Phase.BY_HAND: "by_hand",
    Phase.ENDING: "ending",
}
"""A queue that is flown has several words more: see the report."""
