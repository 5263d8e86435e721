"""Published results: committed numbers read back, tables with intervals, figures for a paper."""
