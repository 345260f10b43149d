#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "analysis/figures/figures.h"
#include "analysis/report/html_page.h"
#include "analysis/report/report.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/comparison.h"
#include "analysis/statistics/sweep_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

std::string link_of(const std::string& figure) {
  return figure == "gains" ? "Gains" : figure == "drivers" ? "Drivers" : "Scatter";
}

void put_pattern(HtmlPage& page, const SweepAnalysis& analysis) {
  page.begin_section("pattern", "The pattern", "Pattern");
  page.body() +=
      "<pre tabindex=\"0\">" + escaped(printable(analysis.pattern->expression, 2000)) + "</pre>\n";
  page.put_note("A shape's name denotes its gain in percent. " + pattern_note(analysis));
  page.end_section();
}

Table sweep_source_table(const SweepAnalysis& analysis) {
  const SweepTable& sweep = analysis.table;
  Table table;
  table.caption = "Settings of the sweep";
  table.header = {"what", "value"};
  table.n_names = 2;
  table.rows = {
      {"file", sweep.source},
      {"protocol", sweep.protocol_name},
      {"design", sweep.design},
      {"points on record", std::to_string(sweep.rows()) + " of " + std::to_string(sweep.planned)},
      {"failed", std::to_string(analysis.n_failed)},
      {"seed", std::to_string(sweep.seed)},
      {"participants at each point", std::to_string(sweep.participants)},
      {"repetitions", std::to_string(sweep.repetitions)},
      {"simulated with palpate", sweep.program_version},
      {"analysed with palpate", analysis.program_version},
      {"parameters", joined(sweep.parameters)}};
  return table;
}

using Json = nlohmann::ordered_json;

Json json_of(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}
Json json_of(const std::optional<Interval>& ends) {
  return ends ? Json{ends->low, ends->high} : Json(nullptr);
}

Json sweep_source_json(const SweepAnalysis& analysis) {
  const SweepTable& table = analysis.table;
  Json out{{"file", table.source},
           {"protocol", table.protocol_name},
           {"design", table.design},
           {"seed", table.seed},
           {"points_planned", table.planned},
           {"points", table.rows()},
           {"failed", analysis.n_failed},
           {"participants", table.participants},
           {"repetitions", table.repetitions},
           {"simulated_with", table.program_version}};
  out["parameters"] = table.parameters;
  out["shapes"] = table.shapes;
  out["renderers"] = table.renderers;
  out["reasons"] = Json::array();
  for (const auto& [reason, points] : table.reasons)
    out["reasons"].push_back({{"points", points}, {"reason", reason}});
  return out;
}

Json pattern_json(const SweepAnalysis& analysis) {
  const PatternShare& pattern = *analysis.pattern;
  Json out{{"expression", pattern.expression},
           {"of_the_paper", pattern.of_the_paper},
           {"holds", pattern.holds},
           {"n", pattern.n},
           {"undefined", pattern.undefined}};
  out["share"] = json_of(pattern.share);
  out["wilson_ci95"] = json_of(pattern.ci95);
  out["note"] = pattern_note(analysis);
  if (!pattern.share) {
    out["status"] = "undefined";
    out["reason"] = "not defined in any setting";
  }
  return out;
}

Json spread_json(const Spread& spread) {
  Json out{{"n", spread.n}};
  out["mean"] = json_of(spread.mean);
  out["sd"] = json_of(spread.sd);
  out["least"] = json_of(spread.least);
  out["q05"] = json_of(spread.q05);
  out["q25"] = json_of(spread.q25);
  out["q50"] = json_of(spread.q50);
  out["q75"] = json_of(spread.q75);
  out["q95"] = json_of(spread.q95);
  out["greatest"] = json_of(spread.greatest);
  out["share_positive"] = json_of(spread.share_positive);
  out["noise_share"] = json_of(spread.noise_share);
  return out;
}

void put_undefined(Json& out, const std::string& reason) {
  if (reason.empty()) return;
  out["status"] = "undefined";
  out["reason"] = reason;
}

Json drivers_json(const SweepAnalysis& analysis, const Drivers& drivers) {
  Json out;
  if (drivers.sobol) {
    out["base_points"] = drivers.sobol->base_points;
    out["base_points_dropped"] = drivers.sobol->dropped;
    out["variance"] = drivers.sobol->variance;
    out["noise_share"] = json_of(drivers.sobol->noise_share);
    if (const std::string note = chance_note(drivers); !note.empty()) out["note"] = note;
    put_undefined(out, drivers.sobol->undefined);
  }
  Json& each = out["parameters"] = Json::object();
  for (std::size_t p = 0; p < analysis.table.parameters.size(); ++p) {
    Json one;
    if (drivers.sobol) {
      const SobolIndex& index = drivers.sobol->of[p];
      one["first_order"] = json_of(index.first);
      one["first_order_ci95"] = json_of(index.first_ci95);
      one["total"] = json_of(index.total);
      one["total_ci95"] = json_of(index.total_ci95);
    } else {
      const RankCorrelation& rank = drivers.ranks[p];
      one["spearman"] = json_of(rank.spearman);
      one["spearman_ci95"] = json_of(rank.spearman_ci95);
      one["partial"] = json_of(rank.partial);
      one["partial_ci95"] = json_of(rank.partial_ci95);
      put_undefined(one, rank.undefined);
    }
    each[analysis.table.parameters[p]] = std::move(one);
  }
  return out;
}

constexpr const char* kSimulated = " (SIMULATED PARTICIPANTS)";
constexpr std::size_t kShownReasons = 20;
constexpr std::size_t kMostInText = 10;  // rows of a table

std::string driver_name(const SweepAnalysis& analysis) {
  return analysis.table.design == "saltelli" ? "Sobol indices" : "rank correlations";
}

std::string paper_gain(const SweepAnalysis& analysis, const std::string& shape) {
  if (analysis.table.renderers != std::vector<std::string>{"point", "ray"}) return "";
  const PaperEffect* const effect = find_paper_effect(shape);
  if (effect == nullptr) return "";
  return effect->percent_reduction ? fixed(*effect->percent_reduction, 0) + " %" : "n.s.";
}

std::string range(const std::optional<double>& low, const std::optional<double>& high,
                  int decimals) {
  return low && high ? fixed(*low, decimals) + " to " + fixed(*high, decimals) : kMissing;
}
std::string range(const std::optional<Interval>& ends) {
  return ends ? range(ends->low, ends->high, 2) : kMissing;
}

Table gains_table(const SweepAnalysis& analysis) {
  Table table;
  table.caption =
      "Less time with the second renderer, percent, over the settings" + std::string(kSimulated);
  table.header = {"shape",       "paper", "settings", "median", "middle 50 %",
                  "middle 90 %", "mean",  "above 0",  "chance"};
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
    const Spread& one = analysis.gains[s];
    const auto percent_of = [](const std::optional<double>& share) {
      return share ? fixed(100 * *share, 0) + " %" : std::string(kMissing);
    };
    table.rows.push_back({analysis.table.shapes[s], paper_gain(analysis, analysis.table.shapes[s]),
                          std::to_string(one.n), one.q50 ? fixed(*one.q50, 1) : kMissing,
                          range(one.q25, one.q75, 1), range(one.q05, one.q95, 1),
                          one.mean ? fixed(*one.mean, 1) : kMissing, percent_of(one.share_positive),
                          percent_of(one.noise_share)});
  }
  table.notes = {
      "chance: share of the variance over the settings due to the studies' standard "
      "standard "
      "errors; more participants or repetitions at each point reduce it."};
  return table;
}

Table drivers_table(const SweepAnalysis& analysis, const Drivers& drivers) {
  Table table;
  const bool sobol = drivers.sobol.has_value();
  table.caption = "Drivers of " + drivers.output + ": " + driver_name(analysis) + kSimulated;
  table.header = sobol
                     ? std::vector<std::string>{"parameter", "total", "95 %", "first order", "95 %"}
                     : std::vector<std::string>{"parameter", "partial", "95 %", "Spearman", "95 %"};
  for (const std::size_t p : drivers.strongest) {
    const std::string& name = analysis.table.parameters[p];
    const auto cell = [](const std::optional<double>& value) {
      return value ? fixed(*value, 2) : kMissing;
    };
    if (sobol) {
      const SobolIndex& one = drivers.sobol->of[p];
      table.rows.push_back(
          {name, cell(one.total), range(one.total_ci95), cell(one.first), range(one.first_ci95)});
    } else {
      const RankCorrelation& one = drivers.ranks[p];
      table.rows.push_back({name, cell(one.partial), range(one.partial_ci95), cell(one.spearman),
                            range(one.spearman_ci95)});
    }
  }
  if (sobol && !drivers.sobol->undefined.empty())
    table.notes.push_back("None: " + drivers.sobol->undefined + ".");
  if (sobol && drivers.sobol->noise_share) {
    table.notes.push_back("Shares of the variance over the settings, of which " +
                          fixed(100 * *drivers.sobol->noise_share, 0) +
                          " % is due to chance within the points and not to a parameter.");
  }
  if (sobol && drivers.sobol->dropped > 0) {
    table.notes.push_back(counted(drivers.sobol->dropped, "base point is", "base points are") +
                          " left out, because a sample lacks the figure.");
  }
  if (const std::string note = chance_note(drivers); !note.empty()) table.notes.push_back(note);
  const auto lacks_partial = [](const RankCorrelation& one) {
    return one.spearman && !one.partial;
  };
  if (std::any_of(drivers.ranks.begin(), drivers.ranks.end(), lacks_partial)) {
    table.notes.emplace_back(
        "No partial correlations: too few points with a figure for so many "
        "parameters, or parameters that "
        "vary together.");
  }
  for (std::size_t p = 0; p < drivers.ranks.size(); ++p) {
    if (!drivers.ranks[p].undefined.empty())
      table.notes.push_back(analysis.table.parameters[p] + ": none, " + drivers.ranks[p].undefined +
                            ".");
  }
  return table;
}

Table reasons_table(const SweepAnalysis& analysis) {
  Table table;
  table.caption = "Reasons of failed points";
  table.header = {"points", "reason"};
  table.n_names = 2;
  const auto& reasons = analysis.table.reasons;
  for (std::size_t i = 0; i < std::min(reasons.size(), kShownReasons); ++i)
    table.rows.push_back({std::to_string(reasons[i].second), reasons[i].first});
  if (reasons.size() > kShownReasons)
    table.notes.push_back("And " + std::to_string(reasons.size() - kShownReasons) +
                          " other reasons.");
  return table;
}

}  // namespace

std::string sweep_html(const SweepAnalysis& analysis) {
  HtmlPage page(sweep_answer(analysis), "SIMULATED PARTICIPANTS");
  page.put_banner(
      "SIMULATED PARTICIPANTS: all numbers below are from a model of a participant, not from "
      "humans.");
  put_list(page.below_title(), analysis.notes);
  if (analysis.pattern) put_pattern(page, analysis);
  for (const Figure& figure : sweep_figures(analysis))
    page.put_figure_section(figure, link_of(figure.id));
  page.begin_section("numbers", "Numbers", "Numbers");
  for (const Table& table : sweep_tables(analysis)) put_table(page.body(), table);
  page.end_section();
  page.begin_section("source", "Source", "Source");
  put_table(page.body(), sweep_source_table(analysis));
  page.end_section();
  return page.html("Made by palpate " + analysis.program_version + ".");
}

std::string sweep_json(const SweepAnalysis& analysis) {
  Json out;
  out["version"] = 1;
  out["simulated"] = true;
  out["program_version"] = analysis.program_version;
  out["sweep"] = sweep_source_json(analysis);
  out["pattern"] = analysis.pattern ? pattern_json(analysis) : Json(nullptr);
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s)
    out["gains"][analysis.table.shapes[s]] = spread_json(analysis.gains[s]);
  for (const Drivers& drivers : analysis.drivers)
    out["drivers"][drivers.output] = drivers_json(analysis, drivers);
  out["bootstrap_seed"] = analysis.seed;
  out["notes"] = analysis.notes;
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<Table> sweep_tables(const SweepAnalysis& analysis) {
  std::vector<Table> out;
  const auto put = [&out](Table table) {
    if (!table.rows.empty()) out.push_back(std::move(table));
  };
  put(gains_table(analysis));
  // Where no driver is known, the notes say why.
  for (const Drivers& drivers : analysis.drivers) out.push_back(drivers_table(analysis, drivers));
  put(reasons_table(analysis));
  return out;
}

std::string sweep_answer(const SweepAnalysis& analysis) {
  const std::size_t points = analysis.table.rows();
  if (!analysis.pattern)
    return counted(points, "setting", "settings") + " of simulated participants";
  const PatternShare& pattern = *analysis.pattern;
  const std::string what = pattern.of_the_paper ? "The paper's pattern" : "The pattern";
  if (!pattern.share) return what + " is defined in none of the settings";
  const std::string share = what + " holds in " + fixed(100 * *pattern.share, 1) + " % of the ";
  if (analysis.table.design == "grid") return share + "grid's points";
  return share + "settings (95 % interval " + fixed(100 * pattern.ci95->low, 1) + " to " +
         fixed(100 * pattern.ci95->high, 1) + " %)";
}

std::string pattern_note(const SweepAnalysis& analysis) {
  if (!analysis.pattern) return "";
  const PatternShare& pattern = *analysis.pattern;
  const std::string design = analysis.table.design;
  std::string out = "It holds in " + std::to_string(pattern.holds) + " of " +
                    std::to_string(pattern.n) +
                    (design == "saltelli" ? " independent settings (A and B of Saltelli's samples)"
                     : design == "grid"   ? " points of the grid"
                                          : " settings");
  if (pattern.undefined > 0) {
    out += "; in " + std::to_string(pattern.undefined) +
           " others it is undefined (the point failed, or a figure is missing)";
  }
  if (design == "grid")
    return out +
           ". No interval: a share of a grid's points does not estimate a share of the space.";
  if (!pattern.ci95) return out + ".";
  return out +
         ". The interval is Wilson's for independent settings; those of a design are more even, so "
         "it is rather "
         "too wide. It refers to the given space with its distributions, not to "
         "people.";
}

std::string chance_note(const Drivers& drivers) {
  if (!drivers.sobol || !drivers.sobol->undefined.empty() || drivers.sobol->noise_share) return "";
  return "Every total index includes chance within the points, because the output has no standard "
         "errors "
         "that could be subtracted.";
}

std::string sweep_text(const SweepAnalysis& analysis) {
  const SweepTable& table = analysis.table;
  std::string out =
      "SIMULATED PARTICIPANTS: a sweep of " +
      (table.protocol_name.empty() ? "a protocol" : table.protocol_name) + ", " +
      counted(table.rows(), "point", "points") + " (" + table.design + ", seed " +
      std::to_string(table.seed) + "), " +
      counted(static_cast<std::size_t>(table.participants), "participant", "participants");
  if (table.repetitions > 0)  // of a protocol without blocks
    out += " and " +
           counted(static_cast<std::size_t>(table.repetitions), "repetition", "repetitions") +
           " each";
  out += "\n\n";
  out += paragraph_text(sweep_answer(analysis) + ".");
  if (analysis.pattern) {
    const PatternShare& pattern = *analysis.pattern;
    out += "  " + printable(pattern.expression, 400) + "\n";
    out += paragraph_text(pattern_note(analysis));
  }
  for (const std::string& note : analysis.notes) out += paragraph_text("Note: " + note);
  for (Table one : sweep_tables(analysis)) {
    const std::size_t more = one.rows.size() > kMostInText ? one.rows.size() - kMostInText : 0;
    if (more > 0) {
      one.rows.resize(kMostInText);
      one.notes.push_back("And " + std::to_string(more) + " more: see --json and --report.");
    }
    out += "\n" + table_text(one);
  }
  return out;
}

}  // namespace palpate::analysis
