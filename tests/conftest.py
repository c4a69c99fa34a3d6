"""What holds for every test."""

from __future__ import annotations

from hypothesis import settings

# a slow machine is no broken law: time is measured in bench/, never in a test
settings.register_profile("waydrop", deadline=None)
settings.load_profile("waydrop")
