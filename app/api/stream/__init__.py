"""The websocket: a snapshot, the events since, then everything as it happens."""
