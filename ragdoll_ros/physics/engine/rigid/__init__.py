"""The package's own engine: clusters, broad phase, and the tables of its kernels."""
