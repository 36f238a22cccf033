"""What robots that remember knew at every moment of a finished run."""
