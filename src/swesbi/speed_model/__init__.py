"""The observation model on measured speeds: measurement noise, model discrepancy, passive scale inferred.

phi = (theta, a) joins the active parameters with the passive scale a of the recording, a nuisance
parameter. Given phi, the log speeds at the measured phases are independent and normal.
"""
