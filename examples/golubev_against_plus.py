# %% [markdown]
# # A figure of one's own
#
# `analysis` is also a library. This page reads a table of answers, asks three questions of it and
# draws a figure that the report does not have: how the preference for Golubev Plus over Golubev
# goes with the time that people took. Run it as a script, or cell by cell in an editor that knows
# `# %%`:
#
#     python examples/golubev_against_plus.py build/thesis/simulated/responses.csv own_figure.svg

# %%
import sys

from matplotlib.figure import Figure

from analysis import read_responses
from analysis.compute import everything
from analysis.figures import BLUE, NARROW_IN, SIMULATED, VERMILLION
from analysis.options import Options

table, out = sys.argv[1:3]
responses = read_responses(table)
print(
    f"{len(responses.frame)} answers of {responses.participants} people"
    + (f", {SIMULATED}" if responses.simulated else "")
)
for finding in responses.findings:
    print(finding)  # rows that are not counted, with their line and the reason

# %% [markdown]
# Everything that the report computes is a data frame: see `analysis.compute` for the columns.
# Margins are decided before the data are seen.

# %%
results = everything(responses, Options(margin=0.25, resamples=1000, seed=1))
a, b = (
    name for name in responses.codebook.techniques if name in ("golubev", "golubev_plus")
)  # in the table's order
pairs = results.tables["pairs"]
about = pairs[(pairs.a == a) & (pairs.b == b)]
print(
    about[
        ["framing", "a", "b", "n", "mean_preference", "low", "high", "holm_p", "tost_p"]
    ].to_string(index=False, float_format="%.3f")
)

# %% [markdown]
# The answers themselves are in `responses.frame`, turned to the pair: negative prefers `a`,
# positive prefers `b`.

# %%
frame = responses.frame
frame = frame[(frame.a == a) & (frame.b == b)]
figure = Figure(figsize=(NARROW_IN, 2.4), layout="constrained")
ax = figure.subplots()
for value, colour in ((-1, BLUE), (0, "#8A8A8A"), (1, VERMILLION)):
    seconds = (frame.rt_ms[frame.preference.clip(-1, 1) == value] / 1000).sort_values()
    if len(seconds):
        ax.step(
            seconds,
            [(place + 1) / len(seconds) for place in range(len(seconds))],
            where="post",
            color=colour,
        )
        label = {-1: a, 0: "no difference", 1: b}[value]
        ax.plot([], [], color=colour, label=f"{label} ({len(seconds)})")
ax.set_xlabel("time of the answer, s", size=8)
ax.set_ylabel("share of answers so far", size=8)
ax.tick_params(labelsize=8)
ax.legend(frameon=False, fontsize=7, loc="lower right")
if responses.simulated:
    figure.suptitle(SIMULATED, size=9, weight="bold", color=VERMILLION)
figure.savefig(out)
print(f"drawn: {out}")
