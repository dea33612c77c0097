"""From a recording to an image."""
