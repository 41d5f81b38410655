"""What a study file may contain: TOML within limits, its schema, and messages on mistakes."""
