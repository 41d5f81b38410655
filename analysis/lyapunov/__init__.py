"""Lyapunov checks: constants with provenance, inequalities, certificates, the ledger."""
