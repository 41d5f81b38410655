"""Sliding motion of ideal relays: what a diagram gives the rates of their inputs.

`reading` reads a diagram for them, `rates` derives them from its expressions.
"""
