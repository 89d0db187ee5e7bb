"""What each figure means, a module a group."""
