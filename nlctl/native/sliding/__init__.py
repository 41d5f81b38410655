"""Sliding motion of ideal relays: what a diagram gives the rates of their inputs.

`rates` derives these from a diagram's expressions.
"""
