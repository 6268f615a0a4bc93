"""How many people a study needs, before it is run: simulated participants, decided by the declared
analysis, from a recorded seed.
"""

from analysis.planning.answering import SIGMA, Answering
from analysis.planning.closed_form import sign_power, t_power, tost_power
from analysis.planning.pilot import fit_pilot
from analysis.planning.plan import ANY, DESIGNS, GOALS, Plan
from analysis.planning.power import closed_form, people_grid, plan_table
from analysis.planning.simulation import Studies
from analysis.planning.words import power_files

__all__ = [
    "ANY",
    "DESIGNS",
    "GOALS",
    "SIGMA",
    "Answering",
    "Plan",
    "Studies",
    "closed_form",
    "fit_pilot",
    "people_grid",
    "plan_table",
    "power_files",
    "sign_power",
    "t_power",
    "tost_power",
]
