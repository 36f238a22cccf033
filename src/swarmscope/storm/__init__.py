"""Storms: random hostile runs that look for contacts, and what their absence proves."""
