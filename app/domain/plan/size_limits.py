"""How large a plan document may be, before anything looks at its meaning. A vehicle's own limits are rules."""

from __future__ import annotations

MAX_BODY_BYTES = 1_048_576
"""One MiB of JSON."""
MAX_ITEMS = 1000
MAX_DEPTH = 16
"""Nested arrays and objects. The format itself needs five."""
MAX_INTEGER_DIGITS = 18
MAX_KEY_CHARS = 200
"""Of a field's name: everything found below it would be told with all of it."""
MAX_FINDINGS = 100
"""Findings of one unreadable document; more would help nobody."""
MAX_POLYGONS = 64
MAX_VERTICES = 1000
MAX_RALLY_POINTS = 256
