#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "analysis/figures/axes.h"
#include "analysis/figures/svg.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/plan.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

using Json = nlohmann::ordered_json;

std::string percent(double share) { return fixed(100 * share, 1) + " %"; }

/// "cone (22.0 %) and cube (11.0 %)".
std::string effects(const StudyModel& model) {
  std::vector<std::string> parts;
  for (std::size_t s = 0; s < model.shapes.size(); ++s) {
    if (model.log_ratios[s] == 0) continue;
    parts.push_back(model.shapes[s] + " (" + fixed(percent_reduction(model.log_ratios[s]), 1) +
                    " %)");
  }
  return joined(parts);
}

std::size_t n_effects(const StudyModel& model) {
  return model.shapes.size() - static_cast<std::size_t>(std::ranges::count(model.log_ratios, 0.0));
}

std::string goal(const Plan& plan) {
  std::string text = "find the gain for " + effects(plan.model);
  if (n_effects(plan.model) > 1)
    text += plan.settings.goal == Goal::all ? ", all of them" : ", any of them";
  return text;
}

std::string test_name(StudyTest test) {
  return test == StudyTest::paired ? "paired t-tests" : "the mixed model's contrasts";
}

std::size_t trials_each(const Plan& plan, std::size_t trials) {
  return 2 * plan.model.shapes.size() * trials;
}

void put_line(std::string& out, const std::string& text, const std::string& indent = "") {
  const auto fits = [&](std::string_view line) { return indent.size() + width(line) <= 100; };
  for (const std::string& line : wrapped(stimuli::printable(text), fits)) {
    out += indent;
    out += shortened(line, 100 - indent.size());
    out += "\n";
  }
}

constexpr std::size_t kNameColumns = 14, kFigureColumns = 12, kWidestShape = 24;

std::string column_name(const Plan& plan, std::size_t shape) {
  return "  " + pad_left(shortened(stimuli::printable(plan.model.shapes[shape]), kWidestShape),
                         kFigureColumns - 2);
}

/// The columns of these shapes.
void put_columns(std::string& out, const Plan& plan, const PlanCurve& curve,
                 std::span<const std::size_t> shapes) {
  out += "  " + pad_right("participants", kNameColumns) + pad_left("goal", kFigureColumns);
  for (const std::size_t s : shapes) out += column_name(plan, s);
  out += "\n";
  for (const PlanPoint& point : curve.points) {
    std::string line = "  " + pad_right(std::to_string(point.design.participants), kNameColumns) +
                       pad_left(percent(goal_power(plan, point.power)), kFigureColumns);
    for (const std::size_t s : shapes) {
      line +=
          pad_left(percent(point.power.share(point.power.found[s])), width(column_name(plan, s)));
    }
    if (curve.smallest && curve.smallest->design.participants == point.design.participants) {
      line += "  <- enough";
    }
    out += line + "\n";
  }
}

/// All shapes, those with an effect first.
void put_curve(std::string& out, const Plan& plan, const PlanCurve& curve) {
  constexpr std::size_t kRoom = 87 - 2 - kNameColumns - kFigureColumns;  // then "<- enough"
  out += "\n";
  put_line(out, "Power with " + counted(curve.trials, "trial", "trials") +
                    " of each shape with each renderer (" +
                    counted(trials_each(plan, curve.trials), "trial", "trials") +
                    " for each participant)");
  std::vector<std::size_t> shapes(plan.model.shapes.size());
  std::iota(shapes.begin(), shapes.end(), std::size_t{0});
  std::stable_partition(shapes.begin(), shapes.end(),
                        [&](std::size_t s) { return plan.model.log_ratios[s] != 0; });
  for (std::size_t first = 0, last = 0; first < shapes.size(); first = last) {
    std::size_t used = 0;
    for (; last < shapes.size(); ++last) {
      used += width(column_name(plan, shapes[last]));
      if (last > first && used > kRoom) break;
    }
    if (first > 0) out += "  (continued)\n";
    put_columns(out, plan, curve, std::span(shapes).subspan(first, last - first));
  }
}

Json power_json(const Plan& plan, const PlanPoint& point) {
  const Power& power = point.power;
  Json out{{"participants", point.design.participants},
           {"trials_per_cell", point.design.trials},
           {"power", goal_power(plan, power)}};
  const double share = goal_power(plan, power);
  out["simulation_se"] = std::sqrt(share * (1 - share) / static_cast<double>(power.studies));
  out["power_all"] = power.share(power.all);
  out["power_any"] = power.share(power.any);
  for (std::size_t s = 0; s < plan.model.shapes.size(); ++s) {
    out["power_by_shape"][plan.model.shapes[s]] = power.share(power.found[s]);
  }
  return out;
}

}  // namespace

std::string plan_text(const Plan& plan) {
  const PlanSettings& settings = plan.settings;
  const StudyModel& model = plan.model;
  std::string out;
  put_line(out, "To " + goal(plan) + ", with power " + percent(settings.power) + " at alpha " +
                    fixed(settings.simulation.alpha, 3) + " (" +
                    test_name(settings.simulation.test) + ", Holm over " +
                    counted(model.shapes.size(), "shape", "shapes") + "):");
  for (const PlanCurve& curve : plan.curves) {
    const std::string trials =
        counted(curve.trials, "trial", "trials") + " of each shape with each renderer";
    if (curve.smallest) {
      put_line(out,
               std::to_string(curve.smallest->design.participants) + " participants with " +
                   trials + " (" + counted(trials_each(plan, curve.trials), "trial", "trials") +
                   " for each participant): power " +
                   percent(goal_power(plan, curve.smallest->power)) + ".",
               "  ");
    } else {
      put_line(out,
               "with " + trials + " " + std::to_string(settings.most) +
                   " participants are not enough: power " +
                   percent(goal_power(plan, curve.points.back().power)) + ".",
               "  ");
    }
  }
  for (const PlanCurve& curve : plan.curves) put_curve(out, plan, curve);
  out += "\n";
  put_line(out, "Log times are drawn with standard deviations: participants' gains " +
                    fixed(model.gain_sd, 3) + ", their gains for single shapes beyond that " +
                    fixed(model.shape_gain_sd, 3) + ", single trials " +
                    fixed(model.residual_sd, 3) + "; " + percent(model.share_used) +
                    " of the trials give a time. " + std::to_string(settings.simulation.studies) +
                    " studies for each figure (standard error of a power at most " +
                    percent(0.5 / std::sqrt(static_cast<double>(settings.simulation.studies))) +
                    "), seed " + std::to_string(settings.simulation.seed) +
                    ". A shape without an effect shows how often it is taken for one.");
  for (const std::string& note : plan.notes) put_line(out, "Note: " + note);
  return out;
}

std::string plan_json(const Plan& plan) {
  const PlanSettings& settings = plan.settings;
  const StudyModel& model = plan.model;
  Json out;
  out["version"] = 1;
  out["pilot_label"] = plan.label.empty() ? Json(nullptr) : Json(plan.label);
  out["settings"] = {{"power", settings.power},
                     {"alpha", settings.simulation.alpha},
                     {"goal", settings.goal == Goal::all ? "all" : "any"},
                     {"test", settings.simulation.test == StudyTest::paired ? "paired" : "model"},
                     {"studies", settings.simulation.studies},
                     {"seed", settings.simulation.seed},
                     {"participants", {settings.least, settings.most}}};
  Json& from = out["model"];
  for (std::size_t s = 0; s < model.shapes.size(); ++s) {
    from["percent_reduction"][model.shapes[s]] =
        model.log_ratios[s] == 0 ? 0 : percent_reduction(model.log_ratios[s]);
    from["log_ratio"][model.shapes[s]] = model.log_ratios[s];
  }
  from["gain_sd"] = model.gain_sd;
  from["shape_gain_sd"] = model.shape_gain_sd;
  from["intercept_sd"] = model.intercept_sd;
  from["correlation"] = model.correlation;
  from["residual_sd"] = model.residual_sd;
  from["share_used"] = model.share_used;
  Json needed = Json::array(), curves = Json::array();
  for (const PlanCurve& curve : plan.curves) {
    needed.push_back({{"trials_per_cell", curve.trials},
                      {"trials_per_participant", trials_each(plan, curve.trials)},
                      {"participants", curve.smallest ? Json(curve.smallest->design.participants)
                                                      : Json(nullptr)}});
    if (!curve.smallest) {
      needed.back()["status"] = "undefined";
      needed.back()["reason"] = "more participants than were looked at";
    }
    Json one{{"trials_per_cell", curve.trials}, {"points", Json::array()}};
    for (const PlanPoint& point : curve.points) one["points"].push_back(power_json(plan, point));
    curves.push_back(std::move(one));
  }
  out["needed"] = std::move(needed);
  out["curves"] = std::move(curves);
  out["notes"] = plan.notes;
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string plan_svg(const Plan& plan) {
  constexpr double kWidth = 720, kHeight = 440, kLeft = 70, kRight = 560, kTop = 70, kBottom = 370;
  // Okabe and Ito's colours; each line has its own marker and its name at its side as well.
  constexpr std::array<std::string_view, 6> kColours{"#0072B2", "#D55E00", "#009E73",
                                                     "#CC79A7", "#56B4E9", "#E69F00"};
  Svg svg;
  svg.rect(0, 0, kWidth, kHeight, "#ffffff");
  const double low = std::log(static_cast<double>(plan.settings.least)),
               high = std::log(static_cast<double>(plan.settings.most));
  const auto x_of = [&](std::size_t participants) {
    const double share =
        high > low ? (std::log(static_cast<double>(participants)) - low) / (high - low) : 0.5;
    return kLeft + share * (kRight - kLeft);
  };
  const auto y_of = [](double power) { return kBottom - power * (kBottom - kTop); };

  const std::string title = "Power to " + goal(plan);
  if (!plan.label.empty()) {
    svg.text(kWidth - 20, kHeight - 12, plan.label + " IN THE PILOT",
             {12, kInk, Svg::Anchor::end, true});
  }
  double line_y = 26;
  for (const std::string& line : lines_of(title, kWidth - 40, 15, true)) {
    svg.text(20, line_y, line, {15, kInk, Svg::Anchor::start, true});
    line_y += 19;
  }
  for (int i = 0; i <= 10; i += 2) {
    const double power = i / 10.0;
    svg.line(kLeft, y_of(power), kRight, y_of(power), kGrid);
    svg.text(kLeft - 8, y_of(power) + 4, std::to_string(10 * i) + " %",
             {12, kSoft, Svg::Anchor::end});
  }
  double last_label = -1e9;
  for (const PlanPoint& point : plan.curves.front().points) {
    const double x = x_of(point.design.participants);
    svg.line(x, kBottom, x, kBottom + 4, kSoft);
    if (x - last_label < 26) continue;
    last_label = x;
    svg.text(x, kBottom + 19, std::to_string(point.design.participants),
             {12, kSoft, Svg::Anchor::middle});
  }
  svg.text((kLeft + kRight) / 2, kBottom + 42, "participants", {13, kInk, Svg::Anchor::middle});
  svg.line(kLeft, y_of(plan.settings.power), kRight, y_of(plan.settings.power), kInk, 1, 0.8);
  svg.text(kRight + 8, y_of(plan.settings.power) + 4, "wanted", {12, kInk});

  // Names at the right, pushed apart where lines end close to each other.
  std::vector<std::pair<double, std::size_t>> ends;
  for (std::size_t c = 0; c < plan.curves.size(); ++c) {
    ends.emplace_back(y_of(goal_power(plan, plan.curves[c].points.back().power)), c);
  }
  std::ranges::sort(ends);
  double next = kTop + 4;
  std::string description;
  for (auto& [end, c] : ends) {
    const double label = std::max(end + 4, next);
    next = label + 17;
    const PlanCurve& curve = plan.curves[c];
    const std::string_view colour = kColours[c % kColours.size()];
    const std::string name = counted(curve.trials, "trial", "trials");
    svg.begin_group(name + " of each shape with each renderer");
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
      const PlanPoint& point = curve.points[i];
      const double x = x_of(point.design.participants), y = y_of(goal_power(plan, point.power));
      if (i > 0) {
        const PlanPoint& before = curve.points[i - 1];
        svg.line(x_of(before.design.participants), y_of(goal_power(plan, before.power)), x, y,
                 colour, 2);
      }
      if (c % 3 == 0) {
        svg.circle(x, y, 3.5, colour);
      } else if (c % 3 == 1) {
        svg.square(x, y, 3.5, colour);
      } else {
        svg.diamond(x, y, 4.5, colour);
      }
    }
    svg.text(kRight + 70, label, name, {12, kInk});
    svg.line(kRight + 8, end, kRight + 62, label - 4, colour, 2, 0.6);
    svg.end_group();
    description += name + " of each shape with each renderer: ";
    description += curve.smallest ? std::to_string(curve.smallest->design.participants) +
                                        " participants are enough. "
                                  : "not enough. ";
  }
  return svg.document(kWidth, kHeight, title, description);
}

}  // namespace palpate::analysis
