"""The native engine: diagrams as machine code."""
