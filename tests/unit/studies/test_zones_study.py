"""The study of patterns by zone, from the spec to its answer."""

import numpy as np
import pytest

from layoutopt.errors import InvalidInput
from layoutopt.progress import Silent
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.runner import run_rounds
from studies.zones import Zones
from studies.zones_setting import setting_of

EASY = {'target_error = "40 mm"': 'target_error = "0.9 m"', 'target_error = "30 mm"': 'target_error = "1 m"'}
OUT_OF_REACH = {'target_error = "40 mm"': 'target_error = "0.1 mm"'}
LAST = """
[[site.zone]]
name = "stand"
region = [[1,1],[2.5,1],[2.5,2.5],[1,2.5]]
target_error = "60 mm"
"""


def _spec(tmp_path, text, changes):
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "spec.toml"
    path.write_text(text, encoding="utf-8")
    return read_spec(path)


def _run(spec):
    study = Zones.for_spec(spec, quick=True)
    ran = run_rounds(study, streams=Streams(seed=spec.seed), journal=None, progress=Silent())
    return study, ran.evaluations


def test_easy_demands_are_met_by_one_pattern_and_the_sparsest_one_is_the_cheapest(tmp_path, tiny_text):
    """Where the sparsest pattern will do, patterns by zone save nothing; both layouts can be read back."""
    spec = _spec(tmp_path, tiny_text, EASY)
    study, evaluations = _run(spec)
    results = study.results(evaluations)
    assert results.saving_eur is not None
    assert results.saving_eur <= 0.0
    answer = study.answer(evaluations, spec)
    assert answer.exit_code == 0
    assert any("save nothing" in line for line in answer.lines(None))
    (tmp_path / "made").mkdir()
    answer.write(tmp_path / "made", streams=Streams(seed=spec.seed), quick=True)
    written = sorted((tmp_path / "made" / "layouts").glob("*.toml"))
    assert {read_layout(path)[1].key for path in written} == {layout.key for layout in answer.layouts}
    money = [results.money(results.accepted(kind)) for kind in ("composed", "uniform")]
    for one in money:
        assert one.readers_eur + sum(one.floor_eur) == pytest.approx(one.total_eur)


def test_a_demand_that_no_pattern_meets_is_refused_with_zone_shortfall_and_nearest(tmp_path, tiny_text):
    """The answer names the zone, by how much it misses, and the layout that is nearest."""
    spec = _spec(tmp_path, tiny_text, OUT_OF_REACH)
    study, evaluations = _run(spec)
    answer = study.answer(evaluations, spec)
    assert answer.exit_code == 1
    assert not answer.layouts
    text = " ".join(answer.lines(None))
    assert "zone 'dock'" in text
    assert "short" in text
    assert "nearest is" in text


def test_a_site_whose_zones_demand_nothing_is_refused(tmp_path, tiny_text):
    """Without a target in any zone there is nothing to compose for, and the message says what would be."""
    spec = _spec(tmp_path, tiny_text, {'target_error = "40 mm"\n': ""})
    with pytest.raises(InvalidInput, match="no zone has a target_error") as caught:
        Zones.for_spec(spec, quick=True)
    assert caught.value.exit_code == 2


def test_a_zone_in_which_no_tag_may_lie_is_served_from_outside(tmp_path, tiny_text):
    """A zone with a target that a plate covers has no pattern of its own, and keeps its demand."""
    covered = {"region = [[3,2],[4,2],[4,3],[3,3]]": "region = [[0,0],[1.6,0],[1.6,1.6],[0,1.6]]"}
    setting = setting_of(_spec(tmp_path, tiny_text, covered))
    assert setting.zones == ("",)
    assert "dock.position_error_mean" in [limit.score for limit in setting.simulated_limits]
    assert any("No tag may lie in zone 'dock'" in note for note in setting.notes)


def test_where_zones_overlap_the_last_one_rules_time_and_tags(tmp_path, tiny_text):
    """Shares sum to one on every drive, and every tag of a composed layout is on one slot."""
    setting = setting_of(_spec(tmp_path, tiny_text, {"[robots]\n": LAST + "[robots]\n"}))
    assert setting.zones == ("", "dock", "stand")
    shares = setting.shares(4)
    np.testing.assert_allclose(shares.ruled.sum(axis=1), 1.0)
    within = shares.within["dock"]
    assert (within[~np.isnan(within[:, 0])][:, 0] == 0.0).all()
    patterns = setting.slots[0].patterns
    group = next(iter(setting.uniform.values()))
    readers = next(iter(group.values())).layout.readers[0]
    layout = setting.composed(readers, [patterns[0], patterns[1], patterns[2]])
    site = setting.problem.design.site
    tags = layout.floor_tags.lay_on(site)
    index = site.zone_of(tags.xy_m, ("dock", "stand"))
    counted = [int((index == number).sum()) for number in (-1, 0, 2)]
    assert list(setting.tags_by_slot(layout)) == counted


def test_a_zone_with_the_pattern_of_the_floor_is_the_uniform_layout(tmp_path, tiny_text):
    """Equal layouts have equal keys, so that none is simulated twice."""
    setting = setting_of(_spec(tmp_path, tiny_text, {}))
    for group in setting.uniform.values():
        for item in group.values():
            pattern = item.layout.floor_tags.base.pattern
            layout = setting.composed(item.layout.readers[0], [pattern] * len(setting.slots))
            assert layout.key == item.layout.key
