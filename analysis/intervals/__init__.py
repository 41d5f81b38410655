"""Interval arithmetic: equations on balls, branch and bound, boxes, level sets."""
