"""Diagrams as FMUs: models of the Functional Mock-up Interface that other simulators run."""
