"""Chattering: a run that switches over and over again at one jump, faster than its tolerance sees.

`detection` finds it while a run is integrated; `place` says at which block.
"""
