"""Studies: the questions that users ask, each answered in rounds of trials."""

from typing import Final

EXTENSION_POINT: Final = "studies"
ROWS: Final = {
    "cost_vs_accuracy": "studies.cost_vs_accuracy:CostVersusAccuracy",
    "against_reference": "studies.against_reference:AgainstReference",
    "pattern_comparison": "studies.pattern_comparison:PatternComparison",
    "pattern_search": "studies.pattern_search:PatternSearch",
    "estimator_comparison": "studies.estimator_comparison:EstimatorComparison",
    "robustness": "studies.robustness:Robustness",
    "reader_groups": "studies.reader_groups:ReaderGroups",
    "zones": "studies.zones:Zones",
    "tag_placement": "studies.tag_placement:TagPlacementStudy",
    "transponder_placement": "studies.transponder_placement:TransponderPlacement",
    "antenna_yaw": "studies.antenna_yaw:AntennaYaw",
    "sampling": "studies.sampling:Sampling",
    "reader_count": "studies.reader_count:ReaderCount",
    "antenna_sizing": "studies.antenna_sizing:AntennaSizing",
    "fleet_size": "studies.fleet_size:FleetSize",
    "recovery": "studies.recovery:Recovery",
    "aliasing": "studies.aliasing:Aliasing",
    "speed": "studies.speed:Speed",
    "dead_tags": "studies.dead_tags:DeadTags",
    "placement_tolerance": "studies.placement_tolerance:PlacementTolerance",
    "hybrid": "studies.hybrid:Hybrid",
    "published/han2006": "studies.published.han2006:Han2006",
    "published/kim2009": "studies.published.kim2009:Kim2009",
    "published/kim2010": "studies.published.kim2010:Kim2010",
    "published/liang2020": "studies.published.liang2020:Liang2020",
    "published/mi2016": "studies.published.mi2016:Mi2016",
}
