#include "analysis/figures/figures_vega.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "analysis/figures/figures_svg.h"
#include "analysis/figures/vega_marks.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

using vega::colour;
using vega::digits;
using vega::Json;
using vega::kFont;
using vega::signal;

constexpr std::size_t kLongestLabel = 18;

/// \param wide name of the signal that holds the panel's width
/// \param height px, of the panel
Json axis_of(const FigureAxis& axis, bool lower, const std::string& wide, double height,
             Json& scales) {
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
              {"labelFont", kFont},
              {"labelFontSize", lower && axis.names ? 13 : 12},
              {"labelColor", colour(lower && axis.names ? Role::ink : Role::soft)},
              {"labelOverlap", !axis.names},
              {"aria", false},
              {"zindex", 0}};
  if (!axis.title.empty()) {
    out["title"] = axis.title;
    out["titleFont"] = kFont;
    out["titleFontSize"] = 12;
    out["titleFontWeight"] = "normal";
    out["titleColor"] = colour(Role::soft);
    out["titlePadding"] = 10;
    if (!lower) out["titleLimit"] = height + 20;
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
  Json axes = Json::array({axis_of(panel.y, false, wide, panel.height, scales),
                           axis_of(panel.x, true, wide, panel.height, scales)});
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
    group["title"] = {{"text", panel.title},  {"anchor", "start"}, {"font", kFont},
                      {"fontSize", 14},       {"frame", "group"},  {"color", colour(Role::ink)},
                      {"fontWeight", "bold"}, {"offset", 10},      {"aria", false}};
  }
  vega::add_marks(group, panel);
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
    shapes.push_back(vega::shape_name(entry.shape));
    const char* comma = fills.empty() ? "" : ", ";
    fills += comma + vega::colour_text(entry.shape == Shape::diamond ? Role::page : entry.role);
    strokes += comma + vega::colour_text(entry.role);
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
                                  {"labelFont", kFont},
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
                     {"frame", "bounds"},    {"font", kFont},
                     {"fontSize", 12.5},     {"fontWeight", "bold"},
                     {"offset", 14},         {"color", colour(Role::amber)},
                     {"aria", false}};
  }
  add_legend(spec, figure);
  return spec;
}

}  // namespace palpate::analysis
