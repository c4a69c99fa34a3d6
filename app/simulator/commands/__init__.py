"""Vehicle commands: receiving, acknowledging, executing."""
