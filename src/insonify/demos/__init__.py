"""Demonstrations: complete surveys with their products."""
