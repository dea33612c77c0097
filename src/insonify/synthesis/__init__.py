"""From arrivals to a recording, in phase or in the mean."""
