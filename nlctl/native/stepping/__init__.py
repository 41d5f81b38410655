"""Runs that are made step by step, by what chooses the inputs."""

from .stepper import Stepper, StepperState, stepper

__all__ = ["Stepper", "StepperState", "stepper"]
