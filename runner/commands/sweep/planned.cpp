#include "runner/commands/sweep/planned.h"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "runner/commands/shared/simulation.h"
#include "runner/session/protocol_info.h"

namespace palpate::runner {
namespace {

namespace po = boost::program_options;
using nlohmann::json;

/// The protocol with --repetitions; no more blocks than those.
json base_protocol(const protocols::Protocol& protocol, const SweepSettings& settings) {
  json out = read_json(protocol.source_text);
  if (settings.repetitions == 0) return out;
  if (protocol.version == 2)
    throw UsageError("--repetitions: the blocks of a protocol of version 2 have their own");
  out["repetitions"] = settings.repetitions;
  if (protocol.blocks_per_renderer > settings.repetitions) {
    out["blocks_per_renderer"] = settings.repetitions;
    std::cerr << "blocks_per_renderer: " << settings.repetitions << " instead of "
              << protocol.blocks_per_renderer << ": no more blocks than repetitions\n";
  }
  return out;
}

std::string sha256_of_files(const protocols::Protocol& protocol) {
  std::string all;
  for (const data::ProtocolFile& file : info_of(protocol).files)
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
  if (protocol.version == 2) {  // columns are of its blocks
    check_names_of_columns(plan, settings.space);
    return plan;
  }
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    plan.shapes.push_back(stimulus.name);
  // The analysis' order: gains are of the ray against the point, whichever is listed first.
  for (const protocols::RendererKind kind :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    if (std::count(protocol.renderers.begin(), protocol.renderers.end(), kind) > 0)
      plan.renderers.emplace_back(to_string(kind));
  }
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

}  // namespace

void add_sweep_options(CommandLine& line, SweepSettings& settings) {
  line.options.add_options()  //
      ("space", po::value(&settings.space)->required()->value_name("FILE"),
       "what varies, and how (JSON)")  //
      ("points", po::value(&settings.points)->required()->value_name("N"),
       "studies; a grid and saltelli have the greatest number up to it that they can")  //
      ("design",
       po::value(&settings.design)->default_value("lhs")->value_name("lhs|sobol|grid|saltelli"),
       "how the points lie: Latin hypercube, Sobol's sequence, all combinations, or Saltelli's "
       "samples for Sobol indices")  //
      ("seed", po::value(&settings.seed)->default_value(settings.seed)->value_name("S"),
       "of the design and, with its number, of every point")  //
      ("participants",
       po::value(&settings.participants)->default_value(settings.participants)->value_name("N"),
       "simulated participants at each point")  //
      ("repetitions", po::value(&settings.repetitions)->value_name("R"),
       "of each shape with each renderer, in place of the protocol's");
  add_participant_version(line, settings.version);
  line.options.add_options()  //
      ("settings", po::value(&settings.patch)->value_name("FILE"),
       "JSON merge patch on those settings, before anything varies");
}

void check_sweep_options(const po::variables_map& values, SweepSettings& settings) {
  constexpr std::int64_t kMostPoints = 100'000'000;
  if (settings.points < 1 || settings.points > kMostPoints)
    throw UsageError("--points: must be 1 to " + std::to_string(kMostPoints));
  check_simulated_participants(settings.participants);
  if (values.count("repetitions") && (settings.repetitions < 1 || settings.repetitions > 1000000))
    throw UsageError("--repetitions: must be 1 to 1000000");
  check_participant_version(values, settings.version);
  settings.protocol = values["PROTOCOL.json"].as<std::string>();
}

PlannedSweep::PlannedSweep(const SweepSettings& settings)
    : protocol(protocols::parse_protocol(settings.protocol)),
      study(base_protocol(protocol, settings), settings.protocol,
            read_json(simulated_settings_text(settings.patch, settings.version)),
            protocols::parse_sweep_space(settings.space), settings.space),
      design(design_of(settings, study)),
      plan(plan_of_sweep(settings, study, design, protocol)) {
  if (design.size() < settings.points) {
    std::cerr << settings.design << ": " << design.size() << " points of the " << settings.points
              << " asked for\n";
  }
}

}  // namespace palpate::runner
