"""Named arrays with units, their HDF5 files, and their evaluation."""
