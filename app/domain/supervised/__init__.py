"""The supervised drop: a pure state machine that decides when a release is sent, and what became of it."""

from app.domain.supervised.inputs import (
    Finish,
    Observation,
    ReleaseAck,
    ReleaseTimedOut,
    ReleaseWithheld,
    Resume,
    RunEnding,
    SendRelease,
)
from app.domain.supervised.machine import DropMachine, step
from app.domain.supervised.terms import DropTerms

__all__ = [
    "DropMachine",
    "DropTerms",
    "Finish",
    "Observation",
    "ReleaseAck",
    "ReleaseTimedOut",
    "ReleaseWithheld",
    "Resume",
    "RunEnding",
    "SendRelease",
    "step",
]
