"""Discrete-event simulation of sensor networks that run distributed inference over real messages."""

__version__ = "0.1.0"
