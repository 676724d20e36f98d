"""Acquisition seeds: what verdicts and scores of the virtual volunteers owe to the noise of one recording."""
