#include "protocols/procedures/procedure.h"

#include <algorithm>

#include "protocols/procedures/track_seed.h"
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

bool is_same(const ParameterGrid& a, const ParameterGrid& b) {
  return a.values == b.values && a.weights == b.weights;
}

bool is_same_quest_plus(const ProcedureSpec& one, const ProcedureSpec& other) {
  const auto *a = std::get_if<QuestPlus>(&one), *b = std::get_if<QuestPlus>(&other);
  if (a == nullptr || b == nullptr) return false;
  return a->function.shape == b->function.shape && a->function.scale == b->function.scale &&
         a->function.easier == b->function.easier && a->levels == b->levels &&
         is_same(a->threshold, b->threshold) && is_same(a->slope, b->slope) &&
         is_same(a->guess, b->guess) && is_same(a->lapse, b->lapse) &&
         a->stop_trials == b->stop_trials && a->stop_entropy_bits == b->stop_entropy_bits;
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
  for (std::size_t i = 0; i < specs.size(); ++i) {
    // A copy has its tables, which are large, in common with the one before, and no use of a seed.
    const auto same = std::find_if(
        specs.begin(), specs.begin() + static_cast<std::ptrdiff_t>(i),
        [&](const ProcedureSpec& other) { return is_same_quest_plus(other, specs[i]); });
    const auto at = static_cast<std::size_t>(same - specs.begin());
    if (at < i) {
      tracks_.push_back(tracks_[at]);
    } else {
      tracks_.emplace_back(specs[i], track_seed(seed, i));
    }
  }
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
