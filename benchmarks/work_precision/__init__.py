"""Run time against error: this package beside stock scikit-fem and Exudyn, on the same problems."""
