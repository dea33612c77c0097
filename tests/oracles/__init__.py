"""Slow, plain references that share no code with the project."""
