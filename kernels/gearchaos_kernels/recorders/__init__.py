"""What is recorded of every lane while lanes are integrated, each in a file of its own."""
