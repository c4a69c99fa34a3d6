"""A run: one flight of one plan by one vehicle, what is left of it, and the delivery report."""
