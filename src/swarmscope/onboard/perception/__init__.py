"""Scan to safe directions, features and areas."""
