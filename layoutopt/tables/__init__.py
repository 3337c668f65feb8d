"""Tables and files of data for those who buy, install and use a layout.

Tags are given in the frame ``map``, readers in ``base_link``, both after REP-103: metres and radians,
right-handed, x forward and y left on a robot, z up. Numbers have six decimals, rows are in the order of their
identity and lines end in a line feed, so equal layouts give equal bytes.
"""
