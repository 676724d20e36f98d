"""Calibration of posteriors on recordings of known phi: rank statistics, expected coverage, two-sample tests.

The same functions judge the network's draws and the importance-weighted ones, over the prior and near one
subject's data. Contraction stands beside every one: the prior returned as posterior is calibrated too.
"""
