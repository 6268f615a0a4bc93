"""How many people a study needs: the names of `analysis.planning`."""

from analysis.planning import *  # noqa: F403
from analysis.planning import __all__  # noqa: F401
