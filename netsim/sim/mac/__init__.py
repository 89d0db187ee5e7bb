"""Medium access: when to send."""
