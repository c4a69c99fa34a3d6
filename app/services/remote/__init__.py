"""What an API node sees of gateways, and what gateways do for API nodes."""
