"""Waydrop on several machines: what gateways send to the cluster's store, and the ports to reach each other."""
