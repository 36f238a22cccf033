"""Scenarios: one file that describes one run completely, and the run made from it."""
