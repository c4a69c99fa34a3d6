"""docs/how-to/follow-a-moving-target.md shows the frames and the reasons that the code has."""

from __future__ import annotations

import re
from typing import get_args

from pydantic import BaseModel

from app.api.target_reports import ANSWER_FRAMES, REPORTER_FRAMES
from app.domain.reasons import ReasonCode
from tests.support.paths import ROOT

PAGE = (ROOT / "docs" / "how-to" / "follow-a-moving-target.md").read_text(encoding="utf-8")


def types_of(frames: tuple[type[BaseModel], ...]) -> set[str]:
    return {literal for frame in frames for literal in get_args(frame.model_fields["type"].annotation)}


def test_the_frames_of_the_page_are_those_of_the_websocket() -> None:
    assert set(re.findall(r'^> \{"type": "(\w+)"', PAGE, re.MULTILINE)) == types_of(REPORTER_FRAMES)
    assert set(re.findall(r'^< \{"type": "(\w+)"', PAGE, re.MULTILINE)) == types_of(ANSWER_FRAMES)


def test_every_reason_to_leave_the_waypoint_is_in_its_table() -> None:
    assert set(re.findall(r"^\| `(target\.\w+)` \|", PAGE, re.MULTILINE)) == {
        code for code in ReasonCode if code.startswith("target.")
    }
