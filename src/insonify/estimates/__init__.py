"""Estimates of what a run takes before it begins: time, memory, disk, compilation, and the error of sub-bands."""
