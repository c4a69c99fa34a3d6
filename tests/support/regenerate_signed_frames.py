"""Signs frames with the released pymavlink: `python -m tests.support.regenerate_signed_frames`.

tests/data/signing/frames.json holds each frame unsigned and signed, with key, link id and timestamp.
"""

from __future__ import annotations

import hashlib
import json
import random

from pymavlink.dialects.v20 import common

from tests.support.paths import ROOT

FRAMES = ROOT / "tests/data/signing/frames.json"


def main() -> None:
    rng = random.Random(2015)
    messages = [
        common.MAVLink_heartbeat_message(2, 12, 157, 67371008, 4, 3),
        common.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        common.MAVLink_global_position_int_message(123456, 473977420, 85455940, 488000, 15600, -12, 30, 0, 27000),
        common.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, float("nan"), 0, 0, 0, 0),
        common.MAVLink_command_ack_message(211, 0, 0, 0, 245, 190),
        common.MAVLink_servo_output_raw_message(77, 0, 1000, 1000, 0, 0, 2000, 0, 0, 0),
        common.MAVLink_statustext_message(2, b"Arming denied: Resolve system health failures first", 7, 0),
        common.MAVLink_mission_count_message(1, 1, 12, 0),
        common.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 3527, 0, 0, 0, 1.5, -2.5, 0, 0, 0, 0, 0, 0),
        common.MAVLink_radio_status_message(190, 180, 90, 40, 38, 0, 0),
        common.MAVLink_encapsulated_data_message(3, list(range(253))),
        common.MAVLink_ping_message(0, 0, 0, 0),
    ]
    rows = []
    for index, message in enumerate(messages):
        key = hashlib.sha256(f"key {index % 3}".encode()).digest()
        link_id, timestamp = index % 5, rng.randrange(1 << 48)
        plain = common.MAVLink(None, srcSystem=1 + index, srcComponent=1)
        plain.seq = index * 20
        unsigned = bytes(message.pack(plain))
        plain.signing.secret_key, plain.signing.sign_outgoing = key, True
        plain.signing.link_id, plain.signing.timestamp = link_id, timestamp
        signed = bytes(message.pack(plain))
        rows.append(
            {
                "message": message.get_type(),
                "key": key.hex(),
                "link_id": link_id,
                "timestamp": timestamp,
                "unsigned": unsigned.hex(),
                "signed": signed.hex(),
            }
        )
    FRAMES.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
