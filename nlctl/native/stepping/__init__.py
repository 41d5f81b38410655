"""Runs that are made step by step, by what chooses the inputs."""

from .stepper import Stepper, StepperState, stepper
from .vector import VectorStepper, vector_stepper

__all__ = ["Stepper", "StepperState", "VectorStepper", "stepper", "vector_stepper"]
