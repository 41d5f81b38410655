"""Imported by the server that forks processes for tests: they start with everything compiled."""

from sweep_examples import experiment

from nlctl.analysis.robustness import evaluate, independent, prepare

made = prepare(experiment())
evaluate(made, independent(made.experiment.space, 3, 1).table, threads=1)
