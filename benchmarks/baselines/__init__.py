"""Failure detectors from the literature, under one protocol and one calibration."""
