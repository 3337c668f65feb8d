"""Findings of three layouts that no study made, their report, and a reader of its HTML."""

import re
from html.parser import HTMLParser

import numpy as np
from shapely.geometry import Polygon, box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators.midrange import Midrange
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.parts import default_prices
from layoutopt.patterns.square import square
from layoutopt.plots.figures import as_svg, new_axes
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.mi2016 import eight
from layoutopt.readers.profiles import PROFILES
from layoutopt.result import Evaluated, Front, Result, Status, Validation
from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Role, Scenario
from layoutopt.scores import Score
from layoutopt.site import Site, Zone
from layoutopt.space import DesignSpace, Family
from objectives.cost import Cost
from solvers.front_measures import exchange_rate
from solvers.layout_difference import layout_difference
from studies.alternatives import Alternative, Alternatives, Wish
from studies.findings import Design, Findings, ReferenceMark
from studies.one_steps import OneStep
from studies.pairing import MeanRatio, Pairing, VarianceRatio
from studies.report import render_report
from studies.trade_off import TradeOff

FACTS = {"layoutopt": "0.1.0", "numpy": "2.4"}
SAVED = MeanRatio(
    ratio=VarianceRatio(value=0.314, low=0.221, high=0.404), comparisons=1, fewest_trials=380, most_trials=380
)
NOTHING_SAVED = MeanRatio(
    ratio=VarianceRatio(value=float("nan"), low=float("nan"), high=float("nan")),
    comparisons=0,
    fewest_trials=0,
    most_trials=0,
)


def layout_of(side_m, pitch_m, count=4):
    mount = Mount(
        antenna=SphereAntenna(side_m=side_m),
        height_m=0.02,
        profile=PROFILES["commercial"],
        antennas_per_module=4,
    )
    tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=pitch_m), origin_m=(0.05, 0.05)),))
    return Layout(floor_tags=tags, readers=(cross(count=count, spacing_m=0.12, mount=mount),))


def metres(value, standard_error, count):
    return Score(value=value, unit="m", standard_error=standard_error, count=count)


def simulated(error_m, standard_error_m, count):
    return {
        "position_error_mean": metres(error_m, standard_error_m, count),
        "position_error_p95": metres(2.1 * error_m, 2.0 * standard_error_m, count),
        "heading_error_mean": Score(value=0.02, unit="rad", standard_error=0.001, count=count),
        "lost_share": Score(value=0.0125, unit="", standard_error=0.0025, count=count),
    }


def findings_of(site_name="ward", zone_name="dock", limits=None):
    """Return findings of three layouts, two on the front, as a study would leave them."""
    site = Site(
        name=site_name,
        floor=Polygon([(0, 0), (6, 0), (6, 4), (0, 4)]),
        obstacles=(box(2, 2, 3, 2.5),),
        zones=(Zone(name=zone_name, region=box(0, 0, 1, 1), target_error_m=0.02),),
    )
    robot = Robot(outline_m=np.array([(-0.3, -0.25), (0.3, -0.25), (0.3, 0.25), (-0.3, 0.25)]))
    design = Scenario(name="design", role=Role.DESIGN, site=site, robot=robot)
    held_out = Scenario(
        name="held-out/1",
        role=Role.HELD_OUT,
        site=site,
        robot=robot,
        faults=Faults(dead_tag_share=0.01, tag_placement_sigma_m=0.003),
    )
    cost = Cost(prices=default_prices(), robot_count=3)
    limits = (Limit(score="position_error_mean", upper=0.012),) if limits is None else limits
    problem = Problem(
        space=DesignSpace(
            readers=(Family(name="cross", build=cross, values={"count": (4,)}),),
            patterns={"": (Family(name="square", build=square, values={"pitch_m": (0.1, 0.2)}),)},
        ),
        design=design,
        held_out=(held_out,),
        objectives=(cost,),
        goals=("cost", "position_error_mean"),
        limits=limits,
        estimators=(Midrange(), OdometryAlone()),
    )
    cheap, dear, beaten = layout_of(0.06, 0.2), layout_of(0.09, 0.1, count=8), layout_of(0.03, 0.1)
    items = {
        name: Evaluated(layout=item, scores={**cost(item, design, None), **simulated(*errors)})
        for name, item, errors in (
            ("cheap", cheap, (0.01034, 0.00021, 400)),
            ("dear", dear, (0.00612, 0.00013, 380)),
            ("beaten", beaten, (0.0250, 0.0011, 60)),
        )
    }
    validations = (
        Validation(
            layout_key=cheap.key,
            scenario="held-out/1",
            estimator="midrange",
            scores=simulated(0.01101, 0.00030, 200),
            optimism=metres(0.00067, 0.00037, 200),
        ),
        Validation(
            layout_key=cheap.key,
            scenario="held-out/1",
            estimator="odometry",
            does_not_apply="it reads no tags & needs none",
        ),
        Validation(
            layout_key=dear.key,
            scenario="held-out/1",
            estimator="midrange",
            scores={"position_error_mean": metres(float("nan"), float("inf"), 1)},
        ),
    )
    mi2016 = Layout(
        floor_tags=dear.floor_tags,
        readers=(
            eight(mount=Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.024, profile=PROFILES["mi2016"])),
        ),
    )
    mark = ReferenceMark(
        label="8 readers, 100 tags/m²",
        layout=mi2016,
        cost=cost(mi2016, design, None)["cost"],
        error=metres(0.0056, 0.0002, 40),
    )
    front = Front(goals=problem.goals, members=(items["cheap"], items["dear"]))
    result = Result(
        status=Status.TARGET_MET,
        front=front,
        recommended={"cheapest": items["cheap"], "knee": items["dear"], "most accurate": items["dear"]},
        trials=840,
    )
    designs = tuple(
        Design(evaluated=item, refusal="", trials=400, on_front=name != "beaten") for name, item in items.items()
    )
    refused = Design(
        evaluated=Evaluated(layout=layout_of(0.06, 0.005), scores={}),
        refusal="tags of 20 mm overlap at a spacing of 5 mm",
        trials=0,
        on_front=False,
    )
    return Findings(
        problem=problem,
        result=result,
        designs=(*designs, refused),
        validations=validations,
        references=(mark,),
        pairing=Pairing(goal=problem.goals[1], comparisons=(), front=SAVED, finalists=NOTHING_SAVED),
        trade_off=trade_off_between(problem, items["cheap"], items["dear"]),
        alternatives=alternatives_to(items["cheap"], items["beaten"]),
        one_steps=(
            OneStep(
                item=items["dear"],
                words="8 antennas instead of 4",
                extra_cost=items["dear"].scores["cost"].value - items["cheap"].scores["cost"].value,
                change=metres(-0.004, 0.0002, 380),
            ),
            OneStep(
                item=items["beaten"],
                words="sides 30 mm instead of 60 mm",
                extra_cost=-12.5,
                change=metres(0.002, 0.004, 3),
            ),
        ),
        candidates_validated=1,
        passed_over=(),
        seed=7,
        reasons={"cheapest": "cheapest that holds", "knee": "the bend", "most accurate": "the end"},
        failures={},
    )


def trade_off_between(problem, cheap, dear):
    """Return an exchange rate of a gain of 4 mm, probabilities and a hypervolume, all made up."""
    rate = exchange_rate(cheap, dear, problem.goals, metres(0.004, 0.0002, 380))
    return TradeOff(
        goal=problem.goals[1],
        rates=(rate,),
        next_steps={"cheapest": rate},
        membership={cheap.layout.key: 0.834, dear.layout.key: 1.0},
        reference=(10_000.0, 0.02),
        hypervolume=Score(value=1.2345, unit="", standard_error=0.0321, count=380),
    )


def alternatives_to(item, other):
    return Alternatives(
        wish=Wish(),
        role="cheapest",
        instead_of=item,
        found=(
            Alternative(
                item=other,
                difference=layout_difference(item.layout, other.layout),
                words="sides 30 mm instead of 60 mm",
                extra_cost=12.5,
                change=metres(0.0007, 0.0001, 60),
            ),
        ),
        by_demand=True,
        near=2,
        proven=True,
        shortfall="1 of 3: only 1 other layout is as good",
    )


def figure_svg(label="x"):
    ax = new_axes(60.0, 40.0)
    ax.plot([0, 1], [0, 1])
    ax.set_title(label, parse_math=False)
    return as_svg(ax)


def page_of(findings, **changes):
    given = {"figures": {"front": figure_svg()}, "facts": FACTS, "drawings": {}, **changes}
    return render_report(findings, **given)


class Reader(HTMLParser):
    """Collects tags, attributes and the text of table rows."""

    def __init__(self):
        super().__init__()
        self.tags, self.attributes, self.rows, self.words = [], [], [], []
        self._row = None

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag == "tr":
            self._row = []
        if tag in ("td", "th") and self._row is not None:
            self._row.append("")

    def handle_endtag(self, tag):
        if tag == "tr" and self._row is not None:
            self.rows.append([" ".join(cell.split()) for cell in self._row])
            self._row = None

    def handle_data(self, text):
        self.words.append(text)
        if self._row:
            self._row[-1] += f" {text}"

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def read(page):
    reader = Reader()
    reader.feed(page)
    reader.close()
    return reader


def scores_in(cell):
    """Return value, standard error and n of each ``a ± b unit (n = c)`` in a cell."""
    found = re.findall(r"([-+]?[\d.]+) ± ([\d.]+) ?\S* \(n = (\d+)\)", cell)
    return [(float(value), float(error), int(count)) for value, error, count in found]
