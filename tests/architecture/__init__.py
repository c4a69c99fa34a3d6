"""The laws of DESIGN.md that a machine can hold."""
