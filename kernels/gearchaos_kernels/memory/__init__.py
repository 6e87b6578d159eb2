"""A block of lanes in memory, and how compiled code reads and writes it."""
