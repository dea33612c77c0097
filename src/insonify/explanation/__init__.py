"""Explanation of a sample: the arrivals behind it, with their losses."""
