"""GIWT from data to deployment: expert data, networks, training, evaluation, export.

Data is made with numpy and numba alone; what needs PyTorch (extra ``learn``) is imported when it is asked for, and
only here.
"""
