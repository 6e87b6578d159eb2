"""Named arrays with units, the HDF5 files that hold them, and what is read off them."""
