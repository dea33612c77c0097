"""Recordings as surveys: their navigation, their place on Earth, and rasters on the terrain."""
