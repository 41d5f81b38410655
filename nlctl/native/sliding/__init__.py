"""Sliding motion of ideal relays: `rates` derives the rates of their inputs from expressions."""
