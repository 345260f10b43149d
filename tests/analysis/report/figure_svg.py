"""Reads figures back from their SVG: panels with their axes, marks by their tooltips, where they are drawn."""

import math
import re
import xml.etree.ElementTree as xml

SVG = "{http://www.w3.org/2000/svg}"
GRID = "#e3e6ea"


def number(text):
    return float(text.replace("−", "-"))


class Panel:
    """A panel's area (px) and the conversion from pixels to its axis, from grid lines and tick labels."""

    def __init__(self, lines):
        self.left, self.right = float(lines[0].get("x1")), float(lines[0].get("x2"))
        heights = [float(line.get("y1")) for line in lines]
        self.bottom, self.top = max(heights), min(heights)
        self.ticks = {}

    def value(self, y):
        (low, y_low), (high, y_high) = min(self.ticks.items()), max(self.ticks.items())
        return low + (high - low) * (y_low - y) / (y_low - y_high)

    def pixel(self, value):
        (low, y_low), (high, y_high) = min(self.ticks.items()), max(self.ticks.items())
        return y_low + (y_high - y_low) * (value - low) / (high - low)


class Drawing:
    """An SVG figure. `log`: tick labels are values, positions their log10."""

    def __init__(self, text, log=False):
        self.root = xml.fromstring(text)
        self.width, self.height = (float(x) for x in self.root.get("viewBox").split()[2:])
        self.texts = list(self.root.iter(SVG + "text"))
        self.description = self.root.find(SVG + "desc").text
        self.panels = self._panels()
        for panel in self.panels:
            for text in self.texts:
                x, y = float(text.get("x")), float(text.get("y")) - 4
                if (text.get("text-anchor") == "end" and abs(x + 9 - panel.left) < 0.02 and
                        panel.top - 1 < y < panel.bottom + 1 and re.fullmatch(r"[−\d.]+", text.text)):
                    panel.ticks[math.log10(number(text.text)) if log else number(text.text)] = y

    def _panels(self):
        """Horizontal grid lines of a panel follow each other from the lowest to the highest."""
        groups = []
        for line in self.root.findall(SVG + "line"):
            if line.get("stroke") != GRID or line.get("y1") != line.get("y2"):
                continue
            if (groups and groups[-1][-1].get("x1") == line.get("x1") and
                    float(line.get("y1")) < float(groups[-1][-1].get("y1"))):
                groups[-1].append(line)
            else:
                groups.append([line])
        return [Panel(group) for group in groups]

    def marks(self, pattern):
        """(match of the tooltip, element) of each mark whose tooltip matches."""
        found = []
        for group in self.root.findall(SVG + "g"):
            title = group.find(SVG + "title")
            if title is not None and (match := re.fullmatch(pattern, title.text)):
                found += [(match, element) for element in group if element.tag != SVG + "title"]
        return found

    def names(self):
        """{name: x} of the categories of the lower axis."""
        return {t.text: float(t.get("x")) for t in self.texts
                if t.get("font-size") == "13.00" and t.get("text-anchor") == "middle"}


def centre(element):
    """Middle of a circle, rect or polygon."""
    if element.tag == SVG + "circle":
        return float(element.get("cx")), float(element.get("cy"))
    if element.tag == SVG + "rect":
        return (float(element.get("x")) + float(element.get("width")) / 2,
                float(element.get("y")) + float(element.get("height")) / 2)
    points = [tuple(map(float, point.split(","))) for point in element.get("points").split()]
    xs, ys = zip(*points)
    return (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2


def box(polygon):
    xs, ys = zip(*(tuple(map(float, point.split(","))) for point in polygon.get("points").split()))
    return min(xs), max(xs), min(ys), max(ys)
