"""What a study file may hold: TOML within limits, its shapes, and what is said of mistakes."""
