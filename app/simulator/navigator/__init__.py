"""The navigator: turns a mode and a mission into setpoints for the dynamics."""
