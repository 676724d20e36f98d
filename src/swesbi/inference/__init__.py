"""Neural posterior estimation: the training pool, the estimator, prior support, posterior, recovery.

Of its modules only ``torch_prior``, ``estimator``, ``training`` and ``sampling`` import torch, which
costs seconds; readers of pools and posteriors need none of them.
"""
