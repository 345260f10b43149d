#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "runner/commands/accuracy_report.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kShapes = {"sphere", "cone", "cylinder", "cube"};
// m; a logarithm must have something for an error of 0, and nobody needs to tell such errors apart.
constexpr double kLeastOfShape = 1e-11, kLeastOfPolyhedron = 1e-18;

struct Colour {
  const char* method;
  const char* colour;
};
// Okabe & Ito's colours, to be told apart by everyone; the product is black.
constexpr std::array kColours = {Colour{"tick", "#000000"},       Colour{"walk", "#0072B2"},
                                 Colour{"walk-float", "#56B4E9"}, Colour{"walk-cold", "#8C8C8C"},
                                 Colour{"scan", "#009E73"},       Colour{"brute-force", "#E69F00"},
                                 Colour{"bullet", "#D55E00"},     Colour{"fcl", "#CC79A7"}};

Json rows_of(const AccuracyReport& report) {
  Json values = Json::array();
  for (const AccuracyRow& row : report.rows) {
    if (row.probe != "ray") continue;
    values.push_back(
        {{"shape", row.shape},
         {"method", row.method},
         {"triangles", row.triangles},
         {"ns", row.ns_per_tick},
         {"of_shape_m", std::max(kLeastOfShape, row.shape_errors.depth.rms)},
         {"of_polyhedron_m", std::max(kLeastOfPolyhedron, row.polyhedron_errors.depth.worst)}});
  }
  return values;
}

Json axis(const char* scale, const char* orient, const std::string& title, const char* format) {
  Json a = {{"scale", scale},  {"orient", orient}, {"grid", true},         {"gridColor", "#e3e6ea"},
            {"domain", false}, {"format", format}, {"labelOverlap", true}, {"tickCount", 5}};
  if (!title.empty()) a["title"] = title;
  a["titleFontSize"] = 11;
  return a;
}

/// A level that matters, across a panel.
void put_level(Json& marks, double metres, const char* text, bool named) {
  const Json y = {{"scale", "of_shape_m"}, {"value", metres}};
  marks.push_back({{"type", "rule"},
                   {"encode",
                    {{"enter",
                      {{"x", {{"value", 0}}},
                       {"x2", {{"signal", "panel_width"}}},
                       {"y", y},
                       {"stroke", {{"value", "#59636e"}}},
                       {"strokeDash", {{"value", {4, 3}}}}}}}}});
  if (!named) return;
  marks.push_back({{"type", "text"},
                   {"encode",
                    {{"enter",
                      {{"x", {{"signal", "panel_width"}, {"offset", -3}}},
                       {"y", y},
                       {"dy", {{"value", -4}}},
                       {"align", {{"value", "right"}}},
                       {"fill", {{"value", "#59636e"}}},
                       {"fontSize", {{"value", 10}}},
                       {"text", {{"value", text}}}}}}}});
}

Json panel(const std::string& shape, const char* field, bool first, const std::string& title,
           bool levels) {
  const Json place = {{"x", {{"scale", "ns"}, {"field", "ns"}}},
                      {"y", {{"scale", field}, {"field", field}}},
                      {"stroke", {{"scale", "method"}, {"field", "method"}}}};
  Json line = place;
  line["strokeWidth"] = {{"signal", "datum.method == 'tick' ? 3 : 1.5"}};
  line["defined"] = {{"signal", "isValid(datum.ns)"}};
  Json dot = {{"x", place["x"]},
              {"y", place["y"]},
              {"fill", place["stroke"]},
              {"size", {{"signal", "datum.method == 'tick' ? 45 : 25"}}},
              {"tooltip", {{"signal", "datum"}}}};
  Json marks = Json::array();
  if (levels) {
    // Named where no line is in the way: a cube has one tessellation.
    put_level(marks, kHand.position, "a hand feels 1 mm", shape == "cube");
    put_level(marks, kDevice.position, "a device resolves 0.03 mm", shape == "cube");
  }
  marks.push_back(
      {{"type", "group"},
       {"from", {{"facet", {{"name", "of_method"}, {"data", "here"}, {"groupby", "method"}}}}},
       {"marks",
        {{{"type", "line"},
          {"from", {{"data", "of_method"}}},
          {"sort", {{"field", "datum.triangles"}}},
          {"encode", {{"enter", line}}}},
         {{"type", "symbol"}, {"from", {{"data", "of_method"}}}, {"encode", {{"enter", dot}}}}}}});
  return {
      {"type", "group"},
      {"title", {{"text", shape}, {"frame", "group"}, {"anchor", "start"}}},
      {"encode",
       {{"enter",
         {{"width", {{"signal", "panel_width"}}},
          {"height", {{"signal", "panel_height"}}},
          {"stroke", {{"value", "#d6dbe1"}}}}}}},
      {"data",
       {{{"name", "here"},
         {"source", "rows"},
         {"transform",
          {{{"type", "filter"}, {"expr", "datum.shape == '" + shape + "'"}},
           {{"type", "collect"}, {"sort", {{"field", "triangles"}}}}}}}}},
      {"axes",
       {axis("ns", "bottom", "ns a tick", "~s"), axis(field, "left", first ? title : "", ".0e")}},
      {"marks", marks}};
}

Json scale(const char* name, const Json& range, const Json& domain) {
  return {{"name", name}, {"type", "log"}, {"range", range}, {"domain", domain}, {"nice", true}};
}

}  // namespace

Json accuracy_figure(const AccuracyReport& report) {
  Json methods = Json::array(), colours = Json::array();
  for (const Colour& colour : kColours) {
    const bool there = std::any_of(report.rows.begin(), report.rows.end(),
                                   [&](const AccuracyRow& r) { return r.method == colour.method; });
    if (!there) continue;
    methods.push_back(colour.method);
    colours.push_back(colour.colour);
  }
  const auto of = [](const char* field) { return Json{{"data", "rows"}, {"field", field}}; };
  const Json across = {0, {{"signal", "panel_width"}}}, up = {{{"signal", "panel_height"}}, 0};
  Json marks = Json::array();
  for (const char* shape : kShapes) {
    marks.push_back(
        panel(shape, "of_shape_m", marks.empty(), "rms error against the shape, m", true));
  }
  for (const char* shape : kShapes) {
    marks.push_back(panel(shape, "of_polyhedron_m", marks.size() == kShapes.size(),
                          "worst against the polyhedron, m", false));
  }
  return {
      {"$schema", "https://vega.github.io/schema/vega/v5.json"},
      {"description",
       "Error over time for each method of finding contact; one panel for each shape, one "
       "symbol for each tessellation; logarithmic both ways."},
      {"title",
       {{"text",
         "Precision over time of a tick: tessellation decides the error, the method the "
         "time"},
        {"subtitle",
         "Top: against the analytic shape. Bottom: against the exact polyhedron. Each line runs "
         "from the coarsest to the finest tessellation; ray, hand at 0.1 m/s."},
        {"anchor", "start"},
        {"fontSize", 15},
        {"offset", 12}}},
      {"background", "white"},
      {"padding", 8},
      {"signals",
       {{{"name", "panel_width"}, {"value", 230}}, {{"name", "panel_height"}, {"value", 230}}}},
      {"layout", {{"columns", 4}, {"padding", {{"row", 76}, {"column", 62}}}, {"bounds", "flush"}}},
      {"data", {{{"name", "rows"}, {"values", rows_of(report)}}}},
      {"scales",
       {scale("ns", across, of("ns")),
        scale("of_shape_m", up, of("of_shape_m")),
        scale("of_polyhedron_m", up, of("of_polyhedron_m")),
        {{"name", "method"}, {"type", "ordinal"}, {"domain", methods}, {"range", colours}}}},
      {"legends",
       {{{"stroke", "method"},
         {"fill", "method"},
         {"title", "method"},
         {"orient", "right"},
         {"symbolType", "circle"}}}},
      {"marks", marks}};
}

}  // namespace palpate
