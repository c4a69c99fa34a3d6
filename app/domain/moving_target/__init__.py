"""A delivery target that moves: what is reported of it, where it can be met, and what that makes of a plan. Pure."""
