"""Named arrays with units, and the HDF5 files that hold them."""
