"""Draws the patches of a stylus over an L in cross-section, for rendering/README.md."""

INK, SOLID, GREY, DARK_GREY = "#222", "#d9dee5", "#8a94a0", "#555f6b"
TIP, TAIL, EDGE, VIRTUAL = "#0072b2", "#007a59", "#b85300", "#e69f00"
SUBSCRIPT = '<tspan dy="5" font-size="12">{}</tspan>'
SCALE, LEFT, TOP, HIGH = 44, 34, 30, 7.3  # px a unit; px; px; units
PANEL = 470  # px from one panel to the next

# The corners of the L, the stylus from tip to tail, where the hand holds its tip.
L = [(0, 0), (7, 0), (7, 2), (2, 2), (2, 6), (0, 6)]
STYLUS, VIRTUAL_TIP = (-2.0, 2.4), (3.1, 1.3)
IDEAL_TIP = (4.0, 2.0)  # the tip on the floor, the tail on the wall


class Drawing:
    def __init__(self):
        self.parts = []
        self.shift = 0

    def at(self, point):
        return self.shift + LEFT + SCALE * point[0], TOP + SCALE * (HIGH - point[1])

    def polygon(self, corners, fill, dashed=False):
        points = " ".join("{:.1f},{:.1f}".format(*self.at(c)) for c in corners)
        border = f' stroke="{GREY}" stroke-dasharray="4 4"' if dashed else ""
        self.parts.append(f'<polygon points="{points}" fill="{fill}"{border}/>')

    def line(self, a, b, colour, width, arrow=False, dashed=False):
        (x, y), (u, v) = self.at(a), self.at(b)
        more = (' marker-end="url(#head)"' if arrow else "") + (' stroke-dasharray="5 4"' if dashed else "")
        self.parts.append(f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{u:.1f}" y2="{v:.1f}" stroke="{colour}" stroke-width="{width}" '
                          f'stroke-linecap="round"{more}/>')

    def dot(self, point, colour):
        x, y = self.at(point)
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{colour}"/>')

    def text(self, point, words, colour=INK, anchor="start", bold=False):
        x, y = self.at(point)
        weight = ' font-weight="bold"' if bold else ""
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}"{weight}>{words}</text>')


def plus(a, b, times=1.0):
    return a[0] + times * b[0], a[1] + times * b[1]


def tool(drawing, tip, colour):
    drawing.line(tip, plus(tip, STYLUS), colour, 5)
    drawing.dot(tip, colour)


def world(drawing):
    drawing.text((0, 7.35), "In the world: a stylus in the corner of an L", bold=True)
    drawing.polygon(L, SOLID)
    tool(drawing, VIRTUAL_TIP, VIRTUAL)
    tool(drawing, IDEAL_TIP, INK)
    drawing.text(plus(VIRTUAL_TIP, (0.1, -0.5)), "virtual tool,", "#8a5a00")
    drawing.text(plus(VIRTUAL_TIP, (0.1, -0.9)), "as the hand holds it", "#8a5a00")
    drawing.text(plus(IDEAL_TIP, (0.25, 0.25)), "ideal tool")


def translations(drawing):
    drawing.text((0, 7.35), "Where its tip may be, at this orientation", bold=True)
    away = (-STYLUS[0], -STYLUS[1])
    drawing.polygon(L, SOLID)
    drawing.polygon([plus(c, away) for c in L], "none", dashed=True)
    # Ends that point into a face carry it; a convex edge between them is crossed by the segment.
    drawing.line((2, 2), (7, 2), TIP, 5)
    drawing.line((0, 6), (2, 6), TIP, 5)
    drawing.line(plus((2, 2), away), plus((2, 6), away), TAIL, 5)
    drawing.line(plus((7, 0), away), plus((7, 2), away), TAIL, 5)
    drawing.line((2, 6), plus((2, 6), away), EDGE, 5)
    drawing.line((7, 2), plus((7, 2), away), EDGE, 5)
    drawing.text((5.0, 1.55), "face and tip", TIP)
    drawing.text((4.15, 3.0), "face and tail", TAIL)
    drawing.text((3.1, 5.1), "convex edge and segment", EDGE)
    drawing.text((0.1, 3.3), "concave edge:", DARK_GREY)
    drawing.text((0.1, 2.9), "no patch", DARK_GREY)
    drawing.line((1.3, 2.7), (1.9, 2.1), DARK_GREY, 1.5, arrow=True)
    drawing.line(VIRTUAL_TIP, (IDEAL_TIP[0], VIRTUAL_TIP[1]), INK, 2, arrow=True)
    drawing.line((IDEAL_TIP[0], VIRTUAL_TIP[1]), IDEAL_TIP, INK, 2, arrow=True)
    drawing.text((2.75, 0.85), f"m{SUBSCRIPT.format('tail')}")
    drawing.text((4.15, 1.4), f"m{SUBSCRIPT.format('tip')}")
    drawing.dot(VIRTUAL_TIP, VIRTUAL)
    drawing.dot(IDEAL_TIP, INK)


def contact_patches():
    """SVG text."""
    drawing = Drawing()
    world(drawing)
    drawing.shift = PANEL
    translations(drawing)
    body = "\n".join(drawing.parts)
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="960" height="480" viewBox="0 0 960 480" role="img" aria-labelledby="patches-title" \
font-family="Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif" font-size="15">
<title id="patches-title">A stylus in the corner of an L, and the patches that hold its tip</title>
<defs><marker id="head" markerWidth="8" markerHeight="8" refX="6" refY="3" orient="auto"><path d="M0,0 L6,3 L0,6 z" fill="{INK}"/></marker></defs>
<rect width="960" height="480" fill="white"/>
{body}
</svg>
"""
