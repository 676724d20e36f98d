"""Is a recording one that the model could have made? Tests with a null distribution, and one verdict.

Every test is judged against well-specified recordings of the same subject: phi from the prior, speeds
under the model's own noise and discrepancy, each with its own exact posterior.
"""
