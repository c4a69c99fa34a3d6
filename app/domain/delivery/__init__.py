"""The delivery report, and the comparison of prediction and flight."""
