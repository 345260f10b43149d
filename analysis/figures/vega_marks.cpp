#include "analysis/figures/vega_marks.h"

#include <charconv>
#include <cmath>
#include <utility>

namespace palpate::analysis::vega {

namespace {

/// With a plain minus: what a path reads.
std::string decimal(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, 3).ptr;
  return std::string(text, end);
}

/// Vega's size of a symbol: area in square px that gives the half width.
double symbol_size(Shape shape, double half) {
  switch (shape) {
    case Shape::circle:
      return 3.14159265 * half * half;
    case Shape::square:
      return 3.24 * half * half;
    case Shape::diamond:
      return 2 * half * half;
    default:
      return 4 * half * half;
  }
}

Json scaled(const char* scale, const char* field) { return {{"scale", scale}, {"field", field}}; }

Json datum_of(const Mark& mark) {
  Json datum = {{"r", static_cast<int>(mark.role)}};
  if (mark.opacity != 1) datum["o"] = mark.opacity;
  if (!mark.text.empty()) datum["t"] = mark.text;
  if (!mark.person.empty()) datum["p"] = mark.person;
  return datum;
}

/// What every mark of a kind has; opacity falls for those who are not pointed at.
Json common_encoding(const char* property, double usual) {
  Json update = {{"tooltip", signal("datum.t || null")}};
  update[property] = signal("(person === '' || !datum.p) ? (datum.o || " + std::to_string(usual) +
                            ") : datum.p === person ? 1 : 0.35 * (datum.o || 1)");
  return update;
}

const std::string kColour = "palette[datum.r]";

/// Marks of one kind with their data, in the panel's group.
void add_points(Json& group, const Panel& panel, Mark::Kind kind, const std::string& name) {
  Json values = Json::array();
  for (const Mark& mark : panel.marks) {
    if (mark.kind != kind) continue;
    Json datum = datum_of(mark);
    datum["x"] = digits(mark.x[0]);
    datum["y"] = digits(mark.y[0]);
    if (mark.x.size() > 1) datum["x2"] = digits(mark.x[1]);
    if (mark.y.size() > 1) datum["y2"] = digits(mark.y[1]);
    if (kind == Mark::Kind::symbol) {
      datum["s"] = digits(symbol_size(mark.shape, mark.size));
      datum["k"] = shape_name(mark.shape);
    }
    if (kind == Mark::Kind::text) {
      datum["s"] = mark.size;
      datum["a"] = mark.anchor < 0 ? "left" : mark.anchor > 0 ? "right" : "center";
      if (mark.bold) datum["b"] = 1;
    }
    if (mark.dx != 0) datum["dx"] = mark.dx;
    if (mark.dy != 0) datum["dy"] = mark.dy;
    values.push_back(std::move(datum));
  }
  if (values.empty()) return;
  group["data"].push_back({{"name", name}, {"values", std::move(values)}});
  Json update = common_encoding("opacity", 1);
  Json x = scaled("x", "x"), y = scaled("y", "y");
  x["offset"] = signal("datum.dx || 0");
  y["offset"] = signal("datum.dy || 0");
  update["x"] = std::move(x);
  update["y"] = std::move(y);
  const char* type = "symbol";
  if (kind == Mark::Kind::symbol) {
    update["shape"] = {{"field", "k"}};
    update["size"] = {{"field", "s"}};
    update["fill"] = signal("datum.k === 'diamond' ? palette[0] : " + kColour);
    update["stroke"] = signal(kColour);
    update["strokeWidth"] = signal("datum.k === 'diamond' || datum.k === 'stroke' ? 2 : 0");
  } else if (kind == Mark::Kind::interval) {
    type = "rule";
    update["y2"] = scaled("y", "y2");
    update["stroke"] = signal(kColour);
    update["strokeWidth"] = {{"value", 2}};
  } else if (kind == Mark::Kind::rect) {
    type = "rect";
    update["x2"] = scaled("x", "x2");
    update["y2"] = scaled("y", "y2");
    update["fill"] = signal(kColour);
  } else {
    type = "text";
    update.erase("tooltip");
    update["text"] = {{"field", "t"}};
    update["font"] = {{"value", kFont}};
    update["fontSize"] = {{"field", "s"}};
    update["align"] = {{"field", "a"}};
    update["fontWeight"] = signal("datum.b ? 'bold' : 'normal'");
    update["fill"] = signal(kColour);
  }
  group["marks"].push_back({{"type", type},
                            {"name", name + "_marks"},
                            {"from", {{"data", name}}},
                            {"aria", false},
                            {"interactive", kind != Mark::Kind::text},
                            {"encode", {{"update", std::move(update)}}}});
}

/// Lines and closed areas: a group of corners each.
void add_paths(Json& group, const Panel& panel, Mark::Kind kind, const std::string& name) {
  Json values = Json::array();
  int id = 0;
  for (const Mark& mark : panel.marks) {
    if (mark.kind != kind) continue;
    ++id;
    for (std::size_t i = 0; i < mark.x.size(); ++i) {
      Json datum = {{"i", id}, {"x", digits(mark.x[i])}, {"y", digits(mark.y[i])}};
      if (i == 0) {  // a line takes all but its corners from its first item
        datum.update(datum_of(mark));
        datum["w"] = mark.size;
      }
      values.push_back(std::move(datum));
    }
  }
  if (values.empty()) return;
  group["data"].push_back({{"name", name}, {"values", std::move(values)}});
  const bool area = kind == Mark::Kind::area;
  Json update = area ? common_encoding("fillOpacity", 0.4) : common_encoding("strokeOpacity", 1);
  update["x"] = scaled("x", "x");
  update["y"] = scaled("y", "y");
  update["stroke"] = signal(kColour);
  update["strokeWidth"] = signal("person !== '' && datum.p === person ? 2.5 : datum.w");
  if (area) {
    update["fill"] = signal(kColour);
    update["interpolate"] = {{"value", "linear-closed"}};
  }
  group["marks"].push_back(
      {{"type", "group"},
       {"from", {{"facet", {{"data", name}, {"name", name + "_one"}, {"groupby", "i"}}}}},
       {"interactive", false},
       {"aria", false},
       {"marks", Json::array({{{"type", "line"},
                               {"name", name + "_marks"},
                               {"from", {{"data", name + "_one"}}},
                               {"aria", false},
                               {"encode", {{"update", std::move(update)}}}}})}});
}

}  // namespace

double digits(double value) {
  if (value == 0 || !std::isfinite(value)) return 0;
  const double power = std::pow(10.0, 5 - std::floor(std::log10(std::fabs(value))));
  return std::round(value * power) / power;
}

std::string shape_name(Shape shape) {
  switch (shape) {
    case Shape::right:
    case Shape::cross:
    case Shape::left:
    case Shape::saltire: {
      std::string path;
      for (const auto& [x, y] : outline_of(shape)) {
        path += path.empty() ? 'M' : 'L';
        path += decimal(x);
        path += ',';
        path += decimal(y);
      }
      return path + "Z";
    }
    case Shape::square:
      return "square";
    case Shape::diamond:
      return "diamond";
    case Shape::up:
      return "triangle-up";
    case Shape::down:
      return "triangle-down";
    case Shape::dash:
      return "stroke";
    case Shape::circle:
      break;
  }
  return "circle";
}

void add_marks(Json& group, const Panel& panel) {
  using Kind = Mark::Kind;
  add_points(group, panel, Kind::rect, "rects");
  add_paths(group, panel, Kind::area, "areas");
  add_paths(group, panel, Kind::line, "lines");
  add_points(group, panel, Kind::interval, "intervals");
  add_points(group, panel, Kind::symbol, "symbols");
  add_points(group, panel, Kind::text, "texts");
}

}  // namespace palpate::analysis::vega
