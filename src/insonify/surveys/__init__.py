"""Recordings as surveys: their navigation, their position on Earth, and rasters on the terrain."""
