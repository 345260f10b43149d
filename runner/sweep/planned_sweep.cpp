#include "runner/sweep/planned_sweep.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/run_record.h"
#include "runner/session/simulated_study.h"
#include "runner/sweep/point_figures.h"
#include "runner/usage_error.h"

namespace palpate::runner::sweep {
namespace {

using nlohmann::json;

/// The protocol with --repetitions, and at most as many blocks.
json base_protocol(const protocols::Protocol& protocol, const SweepSettings& settings,
                   std::ostream& notes) {
  json out = read_json(protocol.source_text);
  if (settings.repetitions == 0) return out;
  if (!out.contains("repetitions"))
    throw UsageError("--repetitions: the blocks of a protocol of version 2 have their own");
  out["repetitions"] = settings.repetitions;
  if (protocol.blocks_per_renderer > settings.repetitions) {
    out["blocks_per_renderer"] = settings.repetitions;
    notes << "blocks_per_renderer: " << settings.repetitions << " instead of "
          << protocol.blocks_per_renderer << ": no more blocks than repetitions\n";
  }
  return out;
}

std::string sha256_of_files(const protocols::Protocol& protocol) {
  std::string all;
  for (const data::ProtocolFile& file : session::info_of(protocol).files)
    all += file.name + '\n' + checksum_hex(file.bytes) + '\n';
  return all.empty() ? "" : checksum_hex(all);
}

/// \throws UsageError
void check_names_of_columns(const data::SweepPlan& plan, const std::string& space) {
  if (const auto alike = data::columns_alike(plan)) {
    throw UsageError(space + ": the parameter '" + alike->first +
                     "' has the name of another column or of a shape, '" + alike->second +
                     "'; give it another one");
  }
}

data::SweepPlan plan_of_sweep(const SweepSettings& settings, const SweptStudy& study,
                              const Design& design, const protocols::Protocol& protocol) {
  data::SweepPlan plan;
  plan.protocol = study.protocol().dump();
  plan.files_sha256 = sha256_of_files(protocol);
  plan.settings = study.settings().dump();
  plan.space = read_json(study.space().source_text).dump();
  plan.design = settings.design;
  plan.points = design.size();
  plan.seed = settings.seed;
  plan.participants = settings.participants;
  plan.program_version = PALPATE_VERSION;
  for (const protocols::SweepParameter& one : study.space().parameters)
    plan.parameters.push_back(one.name);
  swept_kind(protocol).name_columns(protocol, plan);
  check_names_of_columns(plan, settings.space);
  return plan;
}

Design design_of(const SweepSettings& settings, const SweptStudy& study) {
  try {
    return {design_kind(settings.design), settings.points, settings.seed, study.space().parameters};
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--design, --points: ") + error.what());
  }
}

constexpr std::size_t kMaxReason = 300;  // bytes, in the row of a point

std::vector<json> values_of_point(const Sweep& sweep, std::int64_t point) {
  std::vector<json> values;
  const std::vector<double> shares = sweep.design.at(point);
  const auto& parameters = sweep.study.space().parameters;
  for (std::size_t i = 0; i < parameters.size(); ++i)
    values.push_back(parameters[i].value_at(shares[i]));
  return values;
}

data::SweepValue stored(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? 1.0 : 0.0;
  return value.get<double>();
}

/// The reason without file names, the same on every machine.
std::string reason_of(const std::exception& error) {
  std::string text;
  if (const auto* const input = dynamic_cast<const protocols::InputError*>(&error)) {
    for (const protocols::Fault& fault : input->faults())
      text += (text.empty() ? "" : "; ") + fault.location + ": " + fault.expected;
  } else {
    text = error.what();
  }
  std::replace(text.begin(), text.end(), '\n', ' ');
  text = printable(text, kMaxReason);
  return text.empty() ? "unknown" : text;
}

}  // namespace

PlannedSweep::PlannedSweep(const SweepSettings& settings, std::ostream& notes)
    : protocol(protocols::parse_protocol(settings.protocol)),
      study(base_protocol(protocol, settings, notes), settings.protocol,
            read_json(participants::simulated_settings_text(settings.patch, settings.version)),
            protocols::parse_sweep_space(settings.space), settings.space),
      design(design_of(settings, study)),
      plan(plan_of_sweep(settings, study, design, protocol)) {
  if (design.size() < settings.points) {
    notes << settings.design << ": " << design.size() << " points of the " << settings.points
          << " requested\n";
  }
}

PointStudy study_of_point(const Sweep& sweep, std::int64_t point) {
  return sweep.study.at(sweep.plan.seed, point, values_of_point(sweep, point));
}

std::optional<data::SweepRow> run_point(const Sweep& sweep, std::int64_t point,
                                        const std::atomic<bool>& stop) {
  data::SweepRow row;
  row.point = point;
  for (const json& value : values_of_point(sweep, point)) row.values.push_back(stored(value));
  const PointStudy study = study_of_point(sweep, point);
  row.seed = study.seed;
  row.order_seed = study.order_seed;
  try {
    protocols::Protocol protocol = sweep.study.parse(study.protocol);
    const participants::SimulatedSettings settings =
        participants::read_simulated_settings(study.settings.dump());
    session::limit_for_simulation(protocol, settings);
    const std::unique_ptr<PointFigures> figures =
        swept_kind(protocol).figures(protocol, sweep.plan);
    const bool done = session::simulate_in_memory(
        protocol, settings, session::first_numbers(sweep.plan.participants), study.seed, stop,
        [&](int participant, const data::TrialRecord& record, std::uint64_t contact_ticks) {
          figures->add(participant, record, contact_ticks);
        });
    if (!done) return std::nullopt;
    row.figures = figures->figures();
  } catch (const std::exception& error) {
    row.reason = reason_of(error);
    row.figures.assign(data::figure_columns(sweep.plan).size(), std::nullopt);
  }
  return row;
}

}  // namespace palpate::runner::sweep
