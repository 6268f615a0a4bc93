"""Heads to render."""
