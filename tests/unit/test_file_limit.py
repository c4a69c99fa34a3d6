"""The limit of open files is raised to what the connections need, and a start without them is refused."""

from __future__ import annotations

import subprocess
import sys

from tests.support.paths import ROOT

ASKS = """
import resource
from app.config import SettingsError
from app.file_limit import require_files
resource.setrlimit(resource.RLIMIT_NOFILE, ({soft}, {hard}))
try:
    require_files({connections})
except SettingsError as error:
    print(error.detail)
else:
    print(resource.getrlimit(resource.RLIMIT_NOFILE))
"""


def told(*, soft: int, hard: int, connections: int) -> str:
    """What a process with these limits says; they cannot be raised again in the one that runs the tests."""
    script = ASKS.format(soft=soft, hard=hard, connections=connections)
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_low_limit_is_raised_to_what_is_needed() -> None:
    assert told(soft=256, hard=4096, connections=1000) == "(1512, 4096)"


def test_one_that_is_high_enough_stays() -> None:
    assert told(soft=2048, hard=4096, connections=1000) == "(2048, 4096)"


def test_a_hard_limit_that_is_too_low_is_told() -> None:
    said = told(soft=256, hard=1024, connections=1000)
    assert said == "WAYDROP_MAX_CONNECTIONS: 1000 connections need 1512 open files, and 1024 are allowed"
