"""A Bayesian multilevel model of the answers: its draws, tables, picture and page."""

from analysis.posterior.model import Posterior, sample
from analysis.posterior.words import posterior_files

__all__ = ["Posterior", "posterior_files", "sample"]
