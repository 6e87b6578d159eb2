"""The systems that can be integrated, each in a folder, behind one protocol."""
