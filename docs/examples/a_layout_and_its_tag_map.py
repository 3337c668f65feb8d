"""
A layout and its tag map
========================

A layout is made of floor tags and readers. Laid on a site it gives the tag map: every tag with number and
place.
"""

import layoutopt as lo
from layoutopt.plots.layout_plan import draw_layout_plan

spec = lo.read_spec(lo.built_in("small_hall"))

# %%
# Three antennas of 60 mm on a ring under the robot, 20 mm above the tags, and a tag every 280 mm:

mount = lo.Mount(antenna=lo.load("antennas", "sphere")(side_m=0.06), height_m=0.02, profile=spec.reader_profile)
ring = lo.load("readers", "ring")(count=3, radius_m=0.15, mount=mount)
square = lo.ZonePattern(zone="", pattern=lo.load("patterns", "square")(pitch_m=0.28))
layout = lo.Layout(floor_tags=lo.FloorTags(zones=(square,)), readers=(ring,))
tag_map = layout.floor_tags.lay_on(spec.site)

print(layout.label, "-", len(tag_map.xy_m), "tags")
print("first tag:", tag_map.ids[0], tag_map.xy_m[0], "m")
print("rules broken:", [violation.message for violation in lo.check(layout, spec.problem().design)])

# %%
# The plan is to scale; the robot's underside is shown larger beside it.

plan = draw_layout_plan(layout=layout, site=spec.site, robot=spec.robot, tag_map=tag_map)
