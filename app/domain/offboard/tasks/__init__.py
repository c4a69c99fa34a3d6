"""The task queue: navigation patterns, the queue that orders them, and how each one is flown."""
