"""What makes two plans the same plan."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from app.domain.plan.document import Plan


def plan_hash(plan: Plan) -> str:
    """SHA-256 (hex) over the plan's canonical JSON: sorted keys, no spaces, defaults written out."""
    return document_hash(plan.model_dump(mode="json"))


def document_hash(document: Mapping[str, Any]) -> str:
    """The hash of a plan as it is stored, whatever version of Waydrop stored it."""
    canonical = json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    return hashlib.sha256(canonical.encode("utf-8", "surrogatepass")).hexdigest()
