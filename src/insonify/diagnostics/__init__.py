"""Messages on wrong values of a scenario file or a call: problem, line, allowed values, fix."""
