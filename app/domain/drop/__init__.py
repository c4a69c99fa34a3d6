"""A drop: its record, the operator's consent, and the machines that release and observe it."""
