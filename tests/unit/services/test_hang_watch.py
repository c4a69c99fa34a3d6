"""A process whose loop hangs ends, with the stacks that say where; one that lives is left alone."""

from __future__ import annotations

import subprocess
import sys

from tests.support.paths import ROOT

HANGS = """
import asyncio, time
from app.services.hang_watch import hang_watch
async def main():
    async with hang_watch({limit_s}):
        await asyncio.sleep({lives_s})
        time.sleep({hangs_s})
    print("ended by itself")
asyncio.run(main())
"""


def ran(*, limit_s: float, lives_s: float, hangs_s: float) -> subprocess.CompletedProcess[str]:
    script = HANGS.format(limit_s=limit_s, lives_s=lives_s, hangs_s=hangs_s)
    return subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )


def test_a_loop_that_hangs_ends_the_process_and_says_where() -> None:
    ended = ran(limit_s=0.5, lives_s=0.0, hangs_s=50.0)
    assert ended.returncode == 1
    assert "time.sleep" in ended.stderr or "in main" in ended.stderr


def test_a_loop_that_turns_is_left_alone() -> None:
    """For longer than the limit, which is longer than a busy machine lets a process wait."""
    ended = ran(limit_s=5.0, lives_s=6.5, hangs_s=0.0)
    assert (ended.returncode, ended.stdout.strip()) == (0, "ended by itself")
