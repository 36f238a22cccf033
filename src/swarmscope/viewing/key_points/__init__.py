"""Choices of a side by a network with attention, looked into (GIWT Fig. 8, d to f)."""
