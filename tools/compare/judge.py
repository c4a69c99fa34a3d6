"""Compares one recording with its replay, in all aspects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.simulator.geo import LocalFrame
from tools.compare.alignment import Verdict
from tools.compare.course import judge_home, judge_progress, judge_track
from tools.compare.known import KNOWN
from tools.compare.messages import judge_own_commands, judge_replies, judge_words
from tools.compare.release import Release, judge_releases, pair_releases, releases
from tools.compare.replay import Replay
from tools.compare.trace import Dialogue, Trace


@dataclass(frozen=True, slots=True)
class Difference:
    """Something that is not alike. `reason` is None when nobody has explained it."""

    aspect: str
    what: str
    reason: str | None


@dataclass(frozen=True, slots=True)
class Judgement:
    """One scenario's result; `aspects` maps the name of each aspect to what was compared in it.

    `releases` pairs each recorded opening of the gripper with the simulated one.
    """

    scenario: str
    aspects: dict[str, int]
    differences: tuple[Difference, ...]
    releases: tuple[tuple[Release, Release], ...] = ()

    @property
    def agreeing(self) -> list[str]:
        """The aspects without any difference, in order."""
        different = {difference.aspect for difference in self.differences}
        return [aspect for aspect in self.aspects if aspect not in different]

    @property
    def agrees(self) -> bool:
        """No difference without a known reason."""
        return all(difference.reason is not None for difference in self.differences)


def compare(trace: Trace) -> Judgement:
    """Replay the recording and judge."""
    replay = Replay(trace)
    simulated = replay.run()
    return judge(trace, simulated, replay.missed, replay.unsent)


def judge(trace: Trace, simulated: Dialogue, missed: Sequence[str], unsent: Sequence[str] = ()) -> Judgement:
    """`missed`: vehicle actions that the ground side waited for in vain. `unsent`: messages that it could not make."""
    recorded = trace.dialogue
    frame = LocalFrame(*trace.home)
    verdicts = [
        *judge_replies(recorded, simulated),
        *judge_progress(recorded, simulated),
        *judge_releases(recorded, simulated, frame, trace.gripper_servo),
        *judge_track(recorded, simulated, frame),
        *judge_home(recorded, simulated, frame),
        *judge_own_commands(recorded, simulated),
        *judge_words(recorded, simulated),
        Verdict("vehicle actions the ground side waits for", 0, tuple(f"missing: {what}" for what in missed)),
        Verdict("messages of the ground side", 0, tuple(f"not sent: {name}" for name in unsent)),
    ]
    differences = tuple(
        Difference(verdict.aspect, what, reason_for(trace.scenario, verdict.aspect, what))
        for verdict in verdicts
        for what in verdict.differences
    )
    aspects = {one.aspect: one.compared for one in verdicts if one.compared}
    ours, theirs = (list(releases(side, frame, trace.gripper_servo)) for side in (recorded, simulated))
    return Judgement(trace.scenario, aspects, differences, tuple(pair_releases(ours, theirs)))


def reason_for(scenario: str, aspect: str, what: str) -> str | None:
    """Why a difference is known, or None."""
    for known in KNOWN:
        if known.covers(scenario, aspect, what):
            return known.reason
    return None
