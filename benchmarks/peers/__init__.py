"""Other people's packages on the same model: one module for each, that is imported only if the package is installed."""
