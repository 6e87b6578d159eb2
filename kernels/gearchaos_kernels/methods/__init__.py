"""Methods of integration, each in a folder, behind one protocol."""
