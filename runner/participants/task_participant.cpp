#include "runner/participants/task_participant.h"

#include <cstddef>
#include <glm/geometric.hpp>

namespace palpate::runner {
namespace {

constexpr double kLook = 1.5;            // s of feeling in each interval, from the first contact on
constexpr double kLongestLook = 8;       // s, also without contact
constexpr double kLeastDepth = 2e-4;     // m; below it force over depth is noise
constexpr std::uint64_t kJudgement = 9;  // of its random stream; the hand has 1 to 3
constexpr int kMostIntervals = 64;       // trials of the hand within one of the session

}  // namespace

TaskParticipant::TaskParticipant(const SimulatedSettings& own, const ShapeHypotheses& hypotheses,
                                 SimulatedStylus& stylus, const protocols::Protocol& protocol,
                                 std::uint64_t seed, int number)
    : protocol_(protocol),
      hand_(own, hypotheses, stylus, protocol, seed, number),
      judgement_(protocol, {}),
      seed_(seed),
      number_(number),
      period_(1 / protocol.servo_rate) {}

void TaskParticipant::begin_trial(const protocols::Trial& trial) {
  trial_ = trial;
  felt_ = 0;
  judgement_.begin(trial,
                   stimuli::Random(seed_, {static_cast<std::uint64_t>(number_),
                                           static_cast<std::uint64_t>(trial.session),
                                           static_cast<std::uint64_t>(trial.trial), kJudgement}));
}

void TaskParticipant::begin_interval(const protocols::Trial& trial, const IntervalView& view) {
  view_ = view;
  stiffness_sum_ = 0;
  contact_ticks_ = 0;
  if (!view.felt) return;
  protocols::Trial approach = trial;  // each interval is approached in a way of its own
  approach.trial = trial.trial * kMostIntervals + felt_++ % kMostIntervals;
  approach.renderer = view.shown->renderer;
  hand_.begin_trial(approach);
}

Answer TaskParticipant::answer(std::int64_t time_ns) {
  Answer given;
  given.time_ns = answered_ns_ = time_ns;
  const auto& block = protocol_.blocks[static_cast<std::size_t>(trial_.task_block)];
  if (!view_.answers) {
    given.goes_on = true;
  } else if (block.task == protocols::TaskKind::rate && block.answers.empty()) {
    given.number = judgement_.number();
  } else {
    given.stimulus = judgement_.answer();
  }
  return given;
}

std::optional<Answer> TaskParticipant::step(const Sample& sample) {
  if (!view_.felt) return answer(sample.time_ns);
  hand_.step(sample);
  if (sample.phase != Phase::feeling) return std::nullopt;
  const rendering::Rendering& felt = sample.rendering;
  if (felt.contacts > 0 && felt.deepest.depth > kLeastDepth) {
    stiffness_sum_ += glm::length(felt.force) / felt.deepest.depth;
    ++contact_ticks_;
  }
  const double time = sample.tick * period_;
  const bool enough = contact_ticks_ * period_ >= kLook / 3 && time >= kLook;
  if (!enough && time < kLongestLook) return std::nullopt;
  const auto& block = protocol_.blocks[static_cast<std::size_t>(trial_.task_block)];
  std::optional<double> measured;
  if (block.level && block.level->pointer == "/stiffness_n_per_m" && contact_ticks_ > 0)
    measured = stiffness_sum_ / contact_ticks_;
  judgement_.feel(*view_.shown, measured);
  return answer(sample.time_ns);
}

std::optional<Answer> TaskParticipant::confidence(const protocols::ConfidenceSpec& asked) {
  Answer given;
  given.stimulus = judgement_.confidence(static_cast<int>(asked.scale.size()));
  given.time_ns = answered_ns_;
  return given;
}

std::string TaskParticipant::ask(const protocols::PageSpec& page, const protocols::PageItem& item) {
  if (page.kind == protocols::PageSpec::Kind::consent) return "agree";
  switch (item.kind) {
    case protocols::PageItem::Kind::number:
      return item.least ? std::to_string(static_cast<long long>(*item.least)) : "30";
    case protocols::PageItem::Kind::choice:
    case protocols::PageItem::Kind::scale:
      return item.choices.front();
    case protocols::PageItem::Kind::text:
      break;
  }
  return "simulated";
}

}  // namespace palpate::runner
