"""What a site is called."""

from __future__ import annotations

import re
from typing import Final

SITE: Final = re.compile(r"[a-z][a-z0-9]{0,30}")
"""A site's name is part of vehicle ids (`north-v1`) and of NATS subjects, so it has no hyphen and no dot."""
