"""Location set covering by spopt on a square grid; prints the cover as JSON with its seconds.

Run with the interpreter of the solvers' peers: SIDE RADIUS LIMIT_S SOLVER, the last one CBC or HiGHS. The limit
is the solver's alone; the clock also counts the matrix of distances and the model that spopt builds of it.
"""

import json
import math
import os
import sys
import time

import numpy as np
import pulp
from scipy.spatial.distance import cdist
from spopt.locate import LSCP


def main() -> None:
    """Build, solve and print."""
    side, radius, limit_s, name = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
    clock_s, times = time.perf_counter(), time.process_time()
    children = sum(os.times()[2:4])
    places = np.stack(np.divmod(np.arange(side * side), side), axis=1).astype(np.float64)
    model = LSCP.from_cost_matrix(cdist(places, places), radius)
    solver = pulp.PULP_CBC_CMD if name == "CBC" else pulp.HiGHS
    model.problem.solve(solver(msg=False, timeLimit=limit_s, threads=1))
    chosen = [slot for slot, variable in enumerate(model.fac_vars) if (variable.value() or 0.0) > 0.5]
    bound = None
    if name == "HiGHS":
        bound = model.problem.solverModel.getInfo().mip_dual_bound
        bound = bound if math.isfinite(bound) else None
    print(
        json.dumps(
            {
                "chosen": chosen,
                "bound": bound,
                "clock_s": time.perf_counter() - clock_s,
                "processor_s": time.process_time() - times + sum(os.times()[2:4]) - children,
            }
        )
    )


if __name__ == "__main__":
    main()
