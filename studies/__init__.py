"""Code that reproduces the dissertation: planar examples, operation counts, counts of assemblies, trusses of textbooks.

No run needs it and `vgtsim` never imports it. It stays beside the package because the tests and the documents cite it.
"""
