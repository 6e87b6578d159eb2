"""What can be recorded of every lane during an integration, one recorder per file."""
