#include "protocols/procedures/procedure.h"

#include "stimuli/random.h"

namespace palpate::protocols {
namespace {

using Run = std::variant<ConstantStimuliRun, StaircaseRun, QuestPlusRun, LimitsRun>;

Run begin_run(const ProcedureSpec& spec, std::uint64_t seed) {
  if (const auto* constant = std::get_if<ConstantStimuli>(&spec))
    return ConstantStimuliRun(*constant, seed);
  if (const auto* staircase = std::get_if<Staircase>(&spec)) return StaircaseRun(*staircase);
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return QuestPlusRun(*quest);
  return LimitsRun(std::get<Limits>(spec), seed);
}

}  // namespace

Procedure::Procedure(const ProcedureSpec& spec, std::uint64_t seed) : run_(begin_run(spec, seed)) {}

std::optional<double> Procedure::next_level() const {
  return std::visit([](const auto& run) { return run.next_level(); }, run_);
}

void Procedure::record(const Response& response) {
  std::visit([&](auto& run) { run.record(response); }, run_);
  history_.push_back(response);
}

Estimate Procedure::estimate() const {
  return std::visit([](const auto& run) { return run.estimate(); }, run_);
}

Procedure procedure_after(const ProcedureSpec& spec, std::uint64_t seed,
                          const std::vector<Response>& history) {
  Procedure procedure(spec, seed);
  for (const Response& response : history) procedure.record(response);
  return procedure;
}

InterleavedTracks::InterleavedTracks(const std::vector<ProcedureSpec>& specs, std::uint64_t seed)
    : seed_(seed) {
  for (std::size_t i = 0; i < specs.size(); ++i)
    tracks_.emplace_back(specs[i], stimuli::Random(seed, {0x17, i}).next());
  begin_round();
}

void InterleavedTracks::begin_round() {
  round_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (tracks_[i].next_level()) round_.push_back(i);
  }
  stimuli::Random(seed_, {0x18, rounds_++}).shuffle(round_);
}

std::optional<TrackLevel> InterleavedTracks::next() const {
  if (round_.empty()) return std::nullopt;
  return TrackLevel{round_.back(), *tracks_[round_.back()].next_level()};
}

void InterleavedTracks::record(const Response& response) {
  if (round_.empty()) return;
  tracks_[round_.back()].record(response);
  round_.pop_back();
  if (round_.empty()) begin_round();
}

}  // namespace palpate::protocols
