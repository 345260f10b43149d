"""Prints the golden trajectory: over each object of the scene a stylus comes down, slides, rolls and leaves."""

import math

print("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z")
row = 0
for centre in ((0.05, 0, 0), (-0.05, 0.02, 0), (0, -0.06, 0.02)):
    for i in range(80):
        s = i / 79
        dip = math.sin(math.pi * s)
        tip = (centre[0] + 0.015 * math.cos(5 * s), centre[1] - 0.03 + 0.05 * s, centre[2] + 0.05 - 0.045 * dip)
        tilt, turn = 1.55 * dip, 4 * s
        axis = (math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt))
        tail = [tip[k] + 0.12 * axis[k] for k in range(3)]
        print(",".join(f"{v:.5f}" for v in (row / 1000, *tip, *tail)))
        row += 1
