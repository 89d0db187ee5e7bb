"""The network layer: fragmentation, forwarding, routes."""
