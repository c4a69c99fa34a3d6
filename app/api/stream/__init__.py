"""The event websocket: a snapshot, missed events, then live events and telemetry."""
