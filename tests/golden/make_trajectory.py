"""Prints a golden trajectory: over each place of a scene a stylus comes down, slides, rolls and leaves.
Usage: make_trajectory.py shapes|union|tool. For `tool` the stylus turns about itself as well, which is measured.
"""

import math
import sys

PLACES = {"shapes": ((0.05, 0, 0), (-0.05, 0.02, 0), (0, -0.06, 0.02)),
          "union": ((0.02, 0, 0.01), (0.035, 0, 0.005), (0.017, -0.09, 0)),
          "tool": ((-0.02, 0, 0.012), (0.01, 0.01, 0.015), (0, -0.09, 0.005))}
kind = sys.argv[1]
turns = kind == "tool"

print("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z" + (",side_x,side_y,side_z" if turns else ""))
row = 0
for centre in PLACES[kind]:
    for i in range(80):
        s = i / 79
        dip = math.sin(math.pi * s)
        tip = (centre[0] + 0.015 * math.cos(5 * s), centre[1] - 0.03 + 0.05 * s, centre[2] + 0.05 - 0.045 * dip)
        tilt, turn = (0.3 if turns else 1.55) * dip, 4 * s
        axis = (math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt))
        tail = [tip[k] + 0.12 * axis[k] for k in range(3)]
        side = (math.cos(2 * s), math.sin(2 * s), 0) if turns else ()
        print(",".join(f"{v:.5f}" for v in (row / 1000, *tip, *tail, *side)))
        row += 1
