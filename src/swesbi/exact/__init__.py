"""The exact posterior of one recording: importance weights with the simulator, MCMC where they fail.

``proposal`` alone imports torch.
"""
