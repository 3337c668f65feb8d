"""What every solver of the table promises, on problems whose answer is known."""

from dataclasses import replace

import pytest

from layoutopt import feasibility, registry
from layoutopt.evaluate import Evaluator
from layoutopt.problem import Limit
from layoutopt.protocols import SolverCard
from layoutopt.result import Status
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from solvers.stop import MaxTrials, Never

NAMES = registry.names("solvers")


@pytest.fixture
def problem(tiny_spec):
    """The tiny problem with two exact goals, of which every solver can know the front."""
    return replace(read_spec(tiny_spec).problem(), goals=("cost", "published_half_gap"), limits=())


@pytest.fixture
def simulated(tiny_spec):
    """The tiny problem as it is, with a simulated goal."""
    return read_spec(tiny_spec).problem()


def _solver(name):
    return registry.load("solvers", name)()


@pytest.mark.parametrize("name", NAMES)
def test_card_says_what_the_solver_can_do(name):
    """A solver's card is a SolverCard with a sentence and a source."""
    card = _solver(name).card
    assert isinstance(card, SolverCard)
    assert card.summary
    assert card.reference


@pytest.mark.parametrize("name", [name for name in NAMES if registry.card("solvers", name).exact])
def test_exact_solvers_find_the_front_by_brute_force(name, problem):
    """An exact solver's front holds exactly the layouts that no other beats, found here by comparing all."""
    from solvers.exhaustive import exact_scores

    rows = []
    for layout in problem.space.layouts():
        if not feasibility.check(layout, problem.design):
            scores = exact_scores(problem, layout)
            rows.append((scores["cost"].value, scores["published_half_gap"].value))
    best = {row for row in rows if not any(o != row and o[0] <= row[0] and o[1] <= row[1] for o in rows)}
    result = _solver(name)(problem, Evaluator(Streams(seed=1)), Never())
    assert {(m.scores["cost"].value, m.scores["published_half_gap"].value) for m in result.front.members} == best
    assert result.status is Status.OPTIMAL
    assert result.bound == min(row[0] for row in rows)


@pytest.mark.parametrize("name", [name for name in NAMES if registry.card("solvers", name).handles_noise])
def test_noisy_solvers_return_layouts_that_can_be_built_and_repeat_themselves(name, simulated):
    """Same seed, same front; every member can be built; the trials are counted."""
    results = [_solver(name)(simulated, Evaluator(Streams(seed=2)), Never()) for _ in range(2)]
    assert [m.layout.key for m in results[0].front.members] == [m.layout.key for m in results[1].front.members]
    assert results[0].front.members
    for member in results[0].front.members:
        assert not feasibility.check(member.layout, simulated.design)
    assert results[0].trials == results[1].trials > 0


@pytest.mark.parametrize("name", [name for name in NAMES if registry.card("solvers", name).handles_noise])
def test_noisy_solvers_stop_when_told(name, simulated):
    """A limit on trials ends in the status that says so."""
    result = _solver(name)(simulated, Evaluator(Streams(seed=2)), MaxTrials(trials=1))
    assert result.status is Status.STOPPED_BY_LIMIT


@pytest.mark.parametrize("name", [name for name in NAMES if registry.card("solvers", name).handles_noise])
def test_a_target_that_nothing_meets_is_a_status_with_its_shortfall(name, simulated):
    """A limit of a tenth of a millimetre is not met; the shortfall names the nearest layout."""
    hard = replace(simulated, limits=(Limit(score="position_error_mean", upper=0.0001),))
    result = _solver(name)(hard, Evaluator(Streams(seed=2)), Never())
    assert result.status is Status.TARGET_NOT_MET
    assert "nearest is" in result.shortfall


@pytest.mark.parametrize("name", [name for name in NAMES if not registry.card("solvers", name).handles_noise])
def test_exact_solvers_refuse_simulated_goals(name, simulated):
    """A solver that cannot cope with noise says so instead of answering."""
    with pytest.raises(ValueError, match="simulated"):
        _solver(name)(simulated, Evaluator(Streams(seed=1)), Never())
