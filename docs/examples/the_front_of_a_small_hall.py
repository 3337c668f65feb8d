"""
The front of a small hall
=========================

What does accuracy cost? Layouts race on a few simulated drives, and those that none beats in both cost and
error are the front. The study ``cost_vs_accuracy`` does the same with more drives, and then judges the front
on drives that had no part in the choice.
"""

import layoutopt as lo
from layoutopt.evaluate import Evaluator
from layoutopt.plots.front import draw_front
from solvers.racing import Racing
from solvers.stop import Never

spec = lo.read_spec(lo.built_in("small_hall"))

# %%
# A solver gets the problem, something that runs trials, and a rule when to stop.

result = Racing(trials=120)(spec.problem(), Evaluator(lo.Streams(seed=spec.seed)), Never())
print(f"{result.trials} trials")
for member in result.front.members:
    error, cost = member.scores["position_error_mean"], member.scores["cost"]
    shown = f"{1000 * error.value:.1f} ± {1000 * error.standard_error:.1f} mm (n = {error.count})"
    print(f"{member.layout.label}: {cost.value:.0f} EUR, {shown}")

# %%
# Marks have 95 % intervals. The dashed line is the demand of the spec.

front = draw_front(
    designs=(),
    front=result.front,
    recommended=result.recommended,
    references=(),
    target_m=spec.target_error_m,
)
