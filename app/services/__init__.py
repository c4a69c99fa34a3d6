"""What the gateway does: fleet, runs, journal and fan-out."""
