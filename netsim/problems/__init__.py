"""What the nodes are to solve: truth, observations, knowledge and the instance for exact oracles."""
