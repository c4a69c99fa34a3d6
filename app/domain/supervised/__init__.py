"""The supervised drop: a pure state machine that decides when a release is sent, and what became of it."""

from app.domain.supervised.consent_gate import ConsentGate
from app.domain.supervised.ending import still_waits
from app.domain.supervised.inputs import (
    ConsentGiven,
    Divert,
    Finish,
    Observation,
    ReleaseAck,
    ReleaseTimedOut,
    ReleaseWithheld,
    Resume,
    RunEnding,
    SendRelease,
    Silence,
    TargetSight,
)
from app.domain.supervised.machine import step
from app.domain.supervised.state import DropMachine
from app.domain.supervised.terms import DropTerms

__all__ = [
    "ConsentGate",
    "ConsentGiven",
    "Divert",
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
    "Silence",
    "TargetSight",
    "step",
    "still_waits",
]
