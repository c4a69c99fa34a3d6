"""The websocket over which a vehicle is flown by hand."""
