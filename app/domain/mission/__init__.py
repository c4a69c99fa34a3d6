"""The mission: what a vehicle gets, and how a plan is compiled to it."""
