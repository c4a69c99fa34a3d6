"""Drops: the record, operator consent, and the state machines that release and observe."""
