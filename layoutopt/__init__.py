"""layoutopt designs RFID positioning systems for indoor mobile robots.

Conventions: SI units inside, names carry their unit (``pitch_m``, ``angle_rad``, ``price_eur``); angles
counter-clockwise; robot frame after REP-103 (x forward, y left); floor frame with x right and y up. Arrays of
places have shape (n, 2), in metres.
"""

__version__ = "0.1.0"
