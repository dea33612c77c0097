"""One YAML file and the frozen objects it describes."""
