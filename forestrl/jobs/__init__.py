"""What the commands do, apart from their settings: the modules that need torch."""
