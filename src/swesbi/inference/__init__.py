"""Neural posterior estimation: the training pool, the estimator, prior support, posterior, recovery.

Its modules that import torch, which costs seconds, are ``checkpoints``, ``determinism``, ``estimator``,
``sampling``, ``torch_files``, ``torch_prior`` and ``training``; readers of pools and posteriors need none.
"""
