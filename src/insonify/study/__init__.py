"""What is asked of the simulator: the paper's figures, and the story behind a sample."""
