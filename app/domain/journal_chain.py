"""The journal's hash chain: each event's hash covers the event and the hash before it.

Whoever keeps one event's hash (a client's copy, a proof of delivery) can show later that nothing up to that event was
altered, left out or put in between: `waydrop verify-journal --anchor SEQ:HASH`.
"""

from __future__ import annotations

import hashlib
import json
from typing import Final

from pydantic import BaseModel, ConfigDict

GENESIS: Final = "0" * 64
"""What stands before the first event."""


class JournalHead(BaseModel):
    """An event's place in the chain. `hash` is hexadecimal SHA-256; seq 0 with GENESIS is an empty journal."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    seq: int = 0
    hash: str = GENESIS


def event_hash(
    previous: str,
    *,
    gateway: str,
    seq: int,
    kind: str,
    version: int,
    time: float,
    vehicle_id: str | None,
    run_id: str | None,
    data: str,
) -> str:
    """SHA-256 of a compact JSON array: [previous, gateway, seq, kind, version, time, vehicle_id, run_id, data].

    `data` is the JSON text as it is stored, a string in the array: no two readers need agree on how to write JSON.
    """
    fields = [previous, gateway, seq, kind, version, time, vehicle_id, run_id, data]
    text = json.dumps(fields, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
