"""The stages of the study: each reads artefacts, calls the science, writes artefacts."""
