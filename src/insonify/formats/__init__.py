"""File formats of recordings, labels and arrivals."""
