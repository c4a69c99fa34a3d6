"""What makes two plans the same plan."""

from __future__ import annotations

import hashlib
import json

from app.domain.plan.document import Plan


def plan_hash(plan: Plan) -> str:
    """SHA-256 (hex) over the plan's canonical JSON: sorted keys, no spaces, defaults written out."""
    canonical = json.dumps(
        plan.model_dump(mode="json"), sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )
    return hashlib.sha256(canonical.encode("utf-8")).hexdigest()
