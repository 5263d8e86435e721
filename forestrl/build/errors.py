"""What the assembler refuses."""


class ConfigError(ValueError):
    """A setting that is not allowed; the message names it, its value and what is allowed."""
