"""The aspects of a flight that are compared, each in its own file, with its own tolerance."""
