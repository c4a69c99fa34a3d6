"""The steps, oldest first: v0001 and on. A step that was released is never changed."""
