#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/report/sweep_report.h"

namespace palpate::analysis {

namespace {

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
    out["reason"] = "no setting in which it is defined";
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

}  // namespace

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

}  // namespace palpate::analysis
