#include "analysis/figures_vega.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "analysis/figures_svg.h"
#include "analysis/text.h"

namespace palpate {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kVegaFont =
    "system-ui, Helvetica Neue, Arial, Liberation Sans, DejaVu Sans, sans-serif";
constexpr std::size_t kLongestLabel = 18;

Json signal(const std::string& expression) { return {{"signal", expression}}; }

std::string colour_text(Role role) {
  return "palette[" + std::to_string(static_cast<int>(role)) + "]";
}
Json colour(Role role) { return signal(colour_text(role)); }

/// Enough digits for a screen; a page of a big study stays small.
double digits(double value) {
  if (value == 0 || !std::isfinite(value)) return 0;
  const double power = std::pow(10.0, 5 - std::floor(std::log10(std::fabs(value))));
  return std::round(value * power) / power;
}

/// With a plain minus: what a path reads.
std::string decimal(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, 3).ptr;
  return std::string(text, end);
}

/// Vega's name, or a path.
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
    update["font"] = {{"value", kVegaFont}};
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

/// \param wide name of the signal that holds the panel's width
Json axis_of(const FigureAxis& axis, bool lower, const std::string& wide, Json& scales) {
  Json values = Json::array(), labels = Json::array();
  for (const Tick& tick : axis.ticks) {
    values.push_back(digits(tick.at));
    labels.push_back(shortened(tick.label, kLongestLabel));
  }
  const std::string scale = lower ? "x" : "y";
  scales.push_back({{"name", scale + "_labels"},
                    {"type", "ordinal"},
                    {"domain", values},
                    {"range", std::move(labels)}});
  Json out = {{"orient", lower ? "bottom" : "left"},
              {"scale", scale},
              {"values", std::move(values)},
              {"grid", axis.grid},
              {"gridColor", colour(Role::grid)},
              {"domain", false},
              {"ticks", false},
              {"labelPadding", 8},
              {"labelFont", kVegaFont},
              {"labelFontSize", lower && axis.names ? 13 : 12},
              {"labelColor", colour(lower && axis.names ? Role::ink : Role::soft)},
              {"labelOverlap", !axis.names},
              {"aria", false},
              {"zindex", 0}};
  if (!axis.title.empty()) {
    out["title"] = axis.title;
    out["titleFont"] = kVegaFont;
    out["titleFontSize"] = 12;
    out["titleFontWeight"] = "normal";
    out["titleColor"] = colour(Role::soft);
    out["titlePadding"] = 10;
  }
  Json update = {{"text", {{"scale", scale + "_labels"}, {"field", "value"}}}};
  if (lower && axis.names) {
    // Turned where the slots are too narrow for the longest name.
    std::size_t longest = 1;
    for (const Tick& tick : axis.ticks) {
      longest = std::max(longest, width(shortened(tick.label, kLongestLabel)));
    }
    const std::string narrow = wide + " / " + std::to_string(axis.ticks.size()) + " < " +
                               fixed(7.2 * static_cast<double>(longest) + 8, 1);
    update["angle"] = signal(narrow + " ? -35 : 0");
    update["align"] = signal(narrow + " ? 'right' : 'center'");
  }
  out["encode"] = {{"labels", {{"update", std::move(update)}}}};
  return out;
}

double left_room(const Panel& panel) {
  double widest = 0;
  for (const Tick& tick : panel.y.ticks) {
    widest =
        std::max(widest, 7.0 * static_cast<double>(width(shortened(tick.label, kLongestLabel))));
  }
  return widest + (panel.y.title.empty() ? 20 : 44);
}

/// Name of the signal that holds a panel's width.
std::string width_name(std::size_t panel) { return "width_" + std::to_string(panel); }

Json width_signal(const Panel& panel, std::size_t number) {
  // Names need their room: below it the page scrolls.
  const double least =
      std::min(panel.width, panel.x.names ? std::max(220.0, 26.0 * panel.x.high) : 220.0);
  return {{"name", width_name(number)},
          {"update", "min(" + fixed(panel.width, 0) + ", max(" + fixed(least, 0) + ", room - " +
                         fixed(left_room(panel) + 16, 0) + "))"}};
}

Json panel_group(const Panel& panel, std::size_t number) {
  const std::string wide = width_name(number);
  Json scales = Json::array();
  scales.push_back({{"name", "x"},
                    {"domain", {digits(panel.x.low), digits(panel.x.high)}},
                    {"nice", false},
                    {"zero", false},
                    {"range", {0, signal(wide)}}});
  scales.push_back({{"name", "y"},
                    {"domain", {digits(panel.y.low), digits(panel.y.high)}},
                    {"nice", false},
                    {"zero", false},
                    {"range", {panel.height, 0}}});
  Json axes =
      Json::array({axis_of(panel.y, false, wide, scales), axis_of(panel.x, true, wide, scales)});
  Json group = {
      {"type", "group"},
      {"name", "panel_" + std::to_string(number)},
      {"aria", false},
      {"signals",  // by which axes measure their grid
       Json::array(
           {{{"name", "width"}, {"update", wide}}, {{"name", "height"}, {"value", panel.height}}})},
      {"encode", {{"update", {{"width", signal(wide)}, {"height", {{"value", panel.height}}}}}}},
      {"data", Json::array()},
      {"scales", std::move(scales)},
      {"axes", std::move(axes)},
      {"marks", Json::array()}};
  if (!panel.title.empty()) {
    group["title"] = {{"text", panel.title},  {"anchor", "start"}, {"font", kVegaFont},
                      {"fontSize", 14},       {"frame", "group"},  {"color", colour(Role::ink)},
                      {"fontWeight", "bold"}, {"offset", 10},      {"aria", false}};
  }
  using Kind = Mark::Kind;
  add_points(group, panel, Kind::rect, "rects");
  add_paths(group, panel, Kind::area, "areas");
  add_paths(group, panel, Kind::line, "lines");
  add_points(group, panel, Kind::interval, "intervals");
  add_points(group, panel, Kind::symbol, "symbols");
  add_points(group, panel, Kind::text, "texts");
  return group;
}

/// Short names stand in one row, or two columns on a phone; others in as many columns as there is
/// room for, cut where there is little. \return the columns and the width of a label
std::pair<Json, Json> legend_columns(const Figure& figure) {
  constexpr double kShortRow = 800, kShortEntry = 160, kSymbol = 44, kLongest = 240;  // px
  double all = 0, widest = 0;
  for (const LegendEntry& entry : figure.legend) {
    const double wide = kSymbol + std::min(kLongest, 7.2 * static_cast<double>(width(entry.label)));
    all += wide;
    widest = std::max(widest, wide);
  }
  if (all <= kShortRow && widest <= kShortEntry) return {signal("room < 480 ? 2 : 0"), 240};
  return {signal("max(1, floor(room / " + fixed(widest, 0) + "))"),
          signal("room < 480 ? 160 : 240")};
}

void add_legend(Json& spec, const Figure& figure) {
  if (figure.legend.empty()) return;
  Json labels = Json::array(), shapes = Json::array();
  std::string fills, strokes;
  for (const LegendEntry& entry : figure.legend) {
    labels.push_back(entry.label);
    shapes.push_back(shape_name(entry.shape));
    const char* comma = fills.empty() ? "" : ", ";
    fills += comma + colour_text(entry.shape == Shape::diamond ? Role::page : entry.role);
    strokes += comma + colour_text(entry.role);
  }
  const auto scale = [&](const char* name, Json range) {
    spec["scales"].push_back(
        {{"name", name}, {"type", "ordinal"}, {"domain", labels}, {"range", std::move(range)}});
  };
  scale("legend_fill", signal("[" + fills + "]"));
  scale("legend_stroke", signal("[" + strokes + "]"));
  scale("legend_shape", std::move(shapes));
  auto [columns, label_limit] = legend_columns(figure);
  spec["legends"] = Json::array({{{"orient", "top"},
                                  {"direction", "horizontal"},
                                  {"fill", "legend_fill"},
                                  {"stroke", "legend_stroke"},
                                  {"shape", "legend_shape"},
                                  {"symbolStrokeWidth", 2},
                                  {"columns", std::move(columns)},
                                  {"columnPadding", 18},
                                  {"rowPadding", 6},
                                  {"offset", 22},
                                  {"symbolSize", 95},
                                  {"labelFont", kVegaFont},
                                  {"labelFontSize", 13},
                                  {"labelColor", colour(Role::ink)},
                                  {"labelLimit", std::move(label_limit)},
                                  {"aria", false}}});
}

}  // namespace

Json vega_spec(const Figure& figure) {
  Json palette = Json::array();
  const Palette colours = page_palette();
  for (std::size_t r = 0; r < roles_in(figure); ++r) palette.push_back(colours[r]);
  Json hovers = Json::array();
  for (std::size_t p = 0; p < figure.panels.size(); ++p) {
    const bool people = std::ranges::any_of(figure.panels[p].marks,
                                            [](const Mark& mark) { return !mark.person.empty(); });
    if (!people) continue;
    hovers.push_back({{"events", "line:mouseover, symbol:mouseover"},
                      {"update", "datum && datum.p ? datum.p : chosen"}});
    hovers.push_back({{"events", "line:mouseout, symbol:mouseout"}, {"update", "chosen"}});
    break;
  }
  hovers.push_back({{"events", signal("chosen")}, {"update", "chosen"}});
  Json spec = {
      {"description", figure.title + ". " + figure.description},
      {"background", "transparent"},
      {"padding", {{"top", 4}, {"bottom", 4}, {"left", 2}, {"right", 8}}},
      {"autosize", "pad"},
      {"signals", Json::array({{{"name", "palette"}, {"value", std::move(palette)}},
                               {{"name", "room"}, {"value", 1000}},
                               {{"name", "chosen"}, {"value", ""}},
                               {{"name", "person"}, {"value", ""}, {"on", std::move(hovers)}}})},
      {"scales", Json::array()},
      {"layout",
       {{"padding", {{"row", 30}, {"column", 34}}},
        {"bounds", "full"},
        {"align", "none"},
        {"columns", 1}}},
      {"marks", Json::array()}};
  // As many panels side by side as there is room for.
  double widest = 0;
  for (std::size_t p = 0; p < figure.panels.size(); ++p) {
    spec["marks"].push_back(panel_group(figure.panels[p], p));
    spec["signals"].push_back(width_signal(figure.panels[p], p));
    widest = std::max(widest, figure.panels[p].width + left_room(figure.panels[p]) - 12);
  }
  if (figure.panels.size() > 1) {
    spec["layout"]["columns"] =
        signal("max(1, floor((room + 34) / " + fixed(widest + 34, 0) + "))");
  }
  if (!figure.label.empty()) {
    spec["title"] = {{"text", figure.label}, {"anchor", "start"},
                     {"frame", "bounds"},    {"font", kVegaFont},
                     {"fontSize", 12.5},     {"fontWeight", "bold"},
                     {"offset", 14},         {"color", colour(Role::amber)},
                     {"aria", false}};
  }
  add_legend(spec, figure);
  return spec;
}

}  // namespace palpate
