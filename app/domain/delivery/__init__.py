"""What a run proves: the delivery report, and predicted against flown."""
