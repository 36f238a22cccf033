"""What planners decide with: fields, the choice of a side, following, asking, waiting, progress."""
