"""How a journal's tables came to be: one script per step, applied when the journal is opened."""
