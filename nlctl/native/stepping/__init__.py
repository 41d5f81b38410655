"""Runs that are made step by step, by whoever chooses the inputs."""

from .stepper import Stepper, StepperState, stepper

__all__ = ["Stepper", "StepperState", "stepper"]
