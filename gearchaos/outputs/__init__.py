"""The catalogue of outputs: every array that a result may hold, described once."""
