"""Moving delivery targets: what is reported of them, and where a vehicle can meet them."""
