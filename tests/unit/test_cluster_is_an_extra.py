"""The embedded form needs nothing of a cluster: its libraries are an extra."""

from __future__ import annotations

import subprocess
import sys

from tests.support.paths import ROOT

LOOK = "import sys, app.application; sys.exit(bool({'nats', 'asyncpg', 'app.cluster'} & set(sys.modules)))"


def test_the_service_of_one_machine_imports_neither_nats_nor_asyncpg() -> None:
    assert subprocess.run([sys.executable, "-c", LOOK], cwd=ROOT, timeout=300).returncode == 0
