#include "runner/participants/task_participant.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "protocols/tasks/levels.h"

namespace palpate::runner::participants {
namespace {

constexpr double kLook = 1.5;       // s of exploration in each interval after the first contact
constexpr double kLongestLook = 8;  // s, also without contact
constexpr std::uint64_t kJudgement = 9;  // random stream; the hand has 1 to 3
constexpr std::uint64_t kPages = 10;     // likewise
constexpr int kMostIntervals = 64;       // trials of the hand within one of the session

/// Whether the observer of shapes can identify a block's stimuli.
bool is_told_by_shape(const protocols::Protocol& protocol, const protocols::TaskBlock& block) {
  if (block.task != protocols::TaskKind::identify || block.level) return false;
  for (std::size_t i = 0; i < block.stimuli.size(); ++i) {
    const auto object = [&](std::size_t k) -> const stimuli::ObjectSpec& {
      return protocol.stimuli[static_cast<std::size_t>(block.stimuli[k])].object;
    };
    if (!ShapeHypotheses::fault_of(object(i)).empty()) return false;
    for (std::size_t k = 0; k < i; ++k) {
      if (have_one_form(object(i), object(k))) return false;
    }
  }
  return true;
}

/// FNV-1a hash, for seeds.
std::uint64_t number_of(const std::string& name) {
  std::uint64_t hash = 14695981039346656037U;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return hash;
}

}  // namespace

BlockHypotheses block_hypotheses(const protocols::Protocol& protocol) {
  BlockHypotheses all;
  std::map<std::vector<int>, std::shared_ptr<const ShapeHypotheses>> known;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    all.emplace_back();
    if (!is_told_by_shape(protocol, block)) continue;
    std::shared_ptr<const ShapeHypotheses>& shared = known[block.stimuli];
    if (!shared) {
      std::vector<stimuli::ObjectSpec> objects;
      for (const int stimulus : block.stimuli)
        objects.push_back(protocol.stimuli[static_cast<std::size_t>(stimulus)].object);
      shared = std::make_shared<const ShapeHypotheses>(objects);
    }
    all.back() = shared;
  }
  return all;
}

TaskParticipant::TaskParticipant(const SimulatedSettings& own, const ShapeHypotheses& hypotheses,
                                 const BlockHypotheses& of_blocks, devices::SimulatedStylus& stylus,
                                 const protocols::Protocol& protocol, std::uint64_t seed,
                                 int number)
    : protocol_(protocol),
      hand_(own, hypotheses, stylus, protocol, seed, number),
      of_blocks_(of_blocks),
      judgement_(protocol, {}),
      percept_(protocol),
      seed_(seed),
      number_(number),
      period_(1 / protocol.servo_rate) {
  for (const auto& one : of_blocks) {
    if (one && identifiers_.count(one.get()) == 0)
      identifiers_.try_emplace(one.get(), own, *one, stylus, protocol, seed, number);
  }
}

const protocols::TaskBlock& TaskParticipant::block() const {
  return protocol_.blocks[static_cast<std::size_t>(trial_.task_block)];
}

void TaskParticipant::begin_trial(const protocols::Trial& trial) {
  trial_ = trial;
  felt_ = 0;
  const auto& told_apart = of_blocks_[static_cast<std::size_t>(trial.task_block)];
  identifier_ = told_apart ? &identifiers_.at(told_apart.get()) : nullptr;
  judgement_.begin(trial, Random(seed_, {static_cast<std::uint64_t>(number_),
                                         static_cast<std::uint64_t>(trial.session),
                                         static_cast<std::uint64_t>(trial.trial), kJudgement}));
}

void TaskParticipant::begin_interval(const protocols::Trial& trial, const IntervalView& view) {
  view_ = view;
  if (!view.felt) return;
  if (identifier_ != nullptr) return identifier_->begin_trial(trial);
  percept_.begin(trial, *view.shown);
  judged_ = false;
  limited_ = block().interval_limit.has_value();
  // Answer within the time limit.
  constexpr double kShareOfTime = 0.8;
  look_ = std::min(kLook, kShareOfTime * block().interval_limit.value_or(block().time_out));
  protocols::Trial approach = trial;  // each interval has its own approach
  approach.trial = trial.trial * kMostIntervals + felt_++ % kMostIntervals;
  approach.renderer = view.shown->renderer;
  hand_.begin_trial(approach);
}

Answer TaskParticipant::answer(std::int64_t time_ns) {
  Answer given;
  given.time_ns = answered_ns_ = time_ns;
  if (!view_.answers) {
    given.goes_on = true;
  } else if (block().task == protocols::TaskKind::rate && block().answers.empty()) {
    given.number = judgement_.number();
  } else {
    given.stimulus = judgement_.answer();
    given.times = judgement_.turns();
  }
  return given;
}

/// As in version 1; the shape found is converted to an answer by its name.
std::optional<Answer> TaskParticipant::identify(const servo::Sample& sample) {
  std::optional<Answer> found = identifier_->step(sample);
  if (!found) return found;
  const int stimulus = block().stimuli[static_cast<std::size_t>(found->stimulus)];
  const std::string& name = protocol_.stimuli[static_cast<std::size_t>(stimulus)].name;
  const auto& answers = block().answers;
  const auto at = std::find_if(answers.begin(), answers.end(),
                               [&](const auto& answer) { return answer.name == name; });
  found->stimulus = static_cast<int>(at - answers.begin());
  answered_ns_ = found->time_ns;
  return found;
}

std::optional<Answer> TaskParticipant::step(const servo::Sample& sample) {
  if (!view_.felt) return answer(sample.time_ns);
  if (identifier_ != nullptr) return identify(sample);
  hand_.step(sample);
  if (sample.phase != servo::Phase::feeling) return std::nullopt;
  percept_.add(sample);
  if (hand_.percept()) percept_.add(*hand_.percept());
  const double time = sample.tick * period_;
  const double longest = look_ < kLook ? look_ : kLongestLook;
  const bool enough = percept_.contact_ticks() * period_ >= look_ / 3 && time >= look_;
  if (judged_ || (!enough && time < longest)) return std::nullopt;
  judged_ = true;
  const std::optional<double> length = percept_.length();
  judgement_.feel(*view_.shown, {length ? length : percept_.stiffness(), length.has_value(),
                                 percept_.contact_ticks() > 0});
  if (limited_) return std::nullopt;  // the answer is given afterwards, without forces
  return answer(sample.time_ns);
}

std::optional<Answer> TaskParticipant::confidence(const protocols::ConfidenceSpec& asked) {
  Answer given;
  const auto steps = static_cast<int>(asked.scale.size());
  given.stimulus = identifier_ != nullptr
                       ? std::min(static_cast<int>(identifier_->certainty() * steps), steps - 1)
                       : judgement_.confidence(steps);
  given.time_ns = answered_ns_;
  return given;
}

std::string TaskParticipant::ask(const protocols::PageSpec& page, const protocols::PageItem& item) {
  if (page.kind == protocols::PageSpec::Kind::consent) return "agree";
  // Seed with the question, so that the answer does not depend on earlier ones.
  Random random(seed_, {static_cast<std::uint64_t>(number_), kPages, number_of(page.name),
                        number_of(item.name)});
  switch (item.kind) {
    case protocols::PageItem::Kind::number: {
      const double least = item.least.value_or(std::min(0.0, item.most.value_or(0)));
      const double most = item.most.value_or(std::max(100.0, least));
      const double whole = std::ceil(least) + std::floor(random.unit() * (most - least));
      return protocols::level_text(whole <= most ? whole : least);
    }
    case protocols::PageItem::Kind::choice:
    case protocols::PageItem::Kind::scale:
      return item.choices[random.below(item.choices.size())];
    case protocols::PageItem::Kind::text:
      break;
  }
  return "simulated";
}

}  // namespace palpate::runner::participants
