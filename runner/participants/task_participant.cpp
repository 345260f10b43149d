#include "runner/participants/task_participant.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "data/base/cell_name.h"
#include "protocols/parse.h"
#include "protocols/tasks/levels.h"
#include "stimuli/primitives.h"
#include "stimuli/signed_distance.h"

namespace palpate::runner::participants {
namespace {

constexpr double kLeastDepth = 2e-4;              // m; below it force over depth is noise
constexpr double kQuartile = 0.6744897501960817;  // of the normal distribution
constexpr double kLevelStep = 1e-3;               // change of the level, for the derivative
constexpr double kLeastSensitivity = 1e-3;  // movement of the surface for that of the level, m/m

double box_distance(const Vec3& size, const Vec3& point) {
  const Vec3 beyond = glm::abs(point) - 0.5 * size;
  return glm::length(glm::max(beyond, Vec3(0))) +
         std::min(std::max({beyond.x, beyond.y, beyond.z}), 0.0);
}

/// Distance to the surface, m; NaN for a mesh.
double distance_to(const stimuli::ObjectSpec& object, const Vec3& point) {
  const Vec3 local = glm::conjugate(object.pose.orientation) * (point - object.pose.position);
  switch (object.shape) {
    case stimuli::ShapeKind::mesh:
      return std::numeric_limits<double>::quiet_NaN();
    case stimuli::ShapeKind::box:
      return box_distance(object.size, local);
    case stimuli::ShapeKind::none:  // nothing is there to touch
      return std::numeric_limits<double>::infinity();
    case stimuli::ShapeKind::compound: {
      double least = std::numeric_limits<double>::infinity();
      for (const stimuli::ObjectSpec& part : object.parts) {
        const double one = distance_to(part, local);
        if (!(one >= least)) least = one;
      }
      return least;
    }
    default:
      return stimuli::signed_distance(object, local).distance;
  }
}

bool is_length(const std::string& pointer) {
  return pointer.ends_with("_m") || pointer.find("_m/") != std::string::npos;
}

constexpr double kRadian = std::numbers::pi / 180;

constexpr double kPlannedLook = 0.3;  // s, where a plan says nothing of times
constexpr double kLook = 1.5;         // s of exploration in each interval after the first contact
constexpr double kLongestLook = 8;    // s, also without contact
constexpr std::uint64_t kJudgement = 9;  // random stream; the hand has 1 to 3
constexpr std::uint64_t kPages = 10;     // likewise
constexpr int kMostIntervals = 64;       // trials of the hand within one of the session

/// The stimuli of a block that shape tells apart: of those that are one stimulus in several cells
/// and have one form, the first.
std::vector<int> forms_of(const protocols::Protocol& protocol, const protocols::TaskBlock& block) {
  std::vector<int> out;
  for (const int stimulus : block.stimuli) {
    const auto& one = protocol.stimuli[static_cast<std::size_t>(stimulus)];
    const bool known = !block.by_shape && std::ranges::any_of(out, [&](int other) {
      const auto& before = protocol.stimuli[static_cast<std::size_t>(other)];
      return base_name(before.name) == base_name(one.name) &&
             have_one_form(before.object, one.object);
    });
    if (!known) out.push_back(stimulus);
  }
  return out;
}

/// Whether the observer of shapes can identify a block's stimuli.
bool is_identified_by_shape(const protocols::Protocol& protocol,
                            const protocols::TaskBlock& block) {
  if (block.by_shape) return true;
  if (block.task != protocols::TaskKind::identify || !protocols::targets_of(block).empty())
    return false;
  const std::vector<int> forms = forms_of(protocol, block);
  for (std::size_t i = 0; i < forms.size(); ++i) {
    const auto object = [&](std::size_t k) -> const stimuli::ObjectSpec& {
      return protocol.stimuli[static_cast<std::size_t>(forms[k])].object;
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

/// JSON pointer of the number that a block's answers are about; "": nothing is varied.
std::string varied_path(const protocols::TaskBlock& block) {
  if (block.level) return block.level->pointer;
  return block.dimensions.empty() ? "" : protocols::judged_dimension(block).target.pointer;
}

}  // namespace

bool have_one_form(const stimuli::ObjectSpec& a, const stimuli::ObjectSpec& b) {
  const auto form = [](const stimuli::ObjectSpec& o) {
    return std::tuple(o.shape, o.radius, o.height, o.edge, o.size.x, o.size.y, o.size.z, o.file,
                      o.parts.size(), o.pose.position.x, o.pose.position.y, o.pose.position.z,
                      o.pose.orientation.w, o.pose.orientation.x, o.pose.orientation.y,
                      o.pose.orientation.z);
  };
  if (form(a) != form(b)) return false;
  for (std::size_t i = 0; i < a.parts.size(); ++i) {
    if (!have_one_form(a.parts[i], b.parts[i])) return false;
  }
  return true;
}

bool differ_in_stiffness(const protocols::Protocol& protocol, const protocols::TaskBlock& block) {
  const auto object = [&](std::size_t i) -> const stimuli::ObjectSpec& {
    return protocol.stimuli[static_cast<std::size_t>(block.stimuli[i])].object;
  };
  for (std::size_t i = 0; i < block.stimuli.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (!have_one_form(object(i), object(k)) ||
          object(i).material.stiffness == object(k).material.stiffness)
        return false;
    }
  }
  return block.stimuli.size() > 1;
}

void LevelPercept::begin(const protocols::Trial& trial, const protocols::Interval& interval) {
  const auto& block = protocols::block_of(protocol_, trial);
  orientation_ = trial.orientation;
  stiffness_sum_ = squares_ = products_ = 0;
  contact_ticks_ = 0;
  level_.reset();
  const std::string varied = varied_path(block);
  of_stiffness_ = !varied.empty() ? varied == "/stiffness_n_per_m"
                                  : block.task == protocols::TaskKind::identify &&
                                        differ_in_stiffness(protocol_, block);
  if (block.level && interval.stimulus >= 0 && is_length(block.level->pointer))
    know_object(block, interval);
}

void LevelPercept::know_object(const protocols::TaskBlock& block,
                               const protocols::Interval& interval) {
  const std::optional<double> level =
      interval.level ? interval.level : protocols::own_level(protocol_, block, interval.stimulus);
  if (!level) return;
  for (const double step : {kLevelStep * std::abs(*level), -kLevelStep * std::abs(*level)}) {
    try {
      object_ = protocols::at_level(protocol_, block, interval.stimulus, *level).object;
      other_ = protocols::at_level(protocol_, block, interval.stimulus, *level + step).object;
      step_ = step;
      if (step != 0) level_ = level;
      return;
    } catch (const protocols::InputError&) {  // out of range: step the other way
    }
  }
}

void LevelPercept::add(const servo::Sample& sample) {
  const rendering::Rendering& felt = sample.rendering;
  if (felt.contacts == 0 || !(felt.deepest.depth > kLeastDepth)) return;
  stiffness_sum_ += glm::length(felt.force) / felt.deepest.depth;
  ++contact_ticks_;
}

void LevelPercept::add(const Percept& percept) {
  if (!level_ || !percept.contact || (percept.ray && !percept.along)) return;
  Vec3 place = percept.tip;
  if (percept.ray) place += *percept.along * glm::normalize(percept.tail - percept.tip);
  place = glm::conjugate(orientation_) * place;
  const double outside = distance_to(object_, place);
  const double slope = (distance_to(other_, place) - outside) / step_;
  if (!std::isfinite(outside) || !std::isfinite(slope)) return;
  squares_ += slope * slope;
  products_ += slope * outside;
}

std::optional<double> LevelPercept::stiffness() const {
  if (!of_stiffness_ || contact_ticks_ == 0) return std::nullopt;
  return stiffness_sum_ / contact_ticks_;
}

std::optional<double> LevelPercept::length() const {
  if (!level_ || !(squares_ > kLeastSensitivity * kLeastSensitivity)) return std::nullopt;
  return *level_ - products_ / squares_;
}

using protocols::TaskBlock;
using protocols::TaskKind;

void TaskJudgement::begin(const protocols::Trial& trial, const Random& random) {
  trial_ = trial;
  random_ = random;
  estimates_.clear();
  own_.reset();
  turns_ = 1;
  standard_.reset();
  look_.reset();
  evidence_ = 0;
}

const TaskBlock& TaskJudgement::block() const { return protocols::block_of(protocol_, trial_); }

double TaskJudgement::level_of(const protocols::Interval& interval) const {
  if (!block().dimensions.empty())
    return protocols::judged_value(protocol_, block(), interval).value_or(1 + interval.stimulus);
  if (interval.level) return *interval.level;
  if (interval.stimulus < 0) return 0;
  return protocols::own_level(protocol_, block(), interval.stimulus)
      .value_or(1 + interval.stimulus);
}

std::vector<double> TaskJudgement::levels() const {
  if (block().dimensions.empty()) return protocols::levels_of(block());
  const std::string judged = varied_path(block());
  const std::vector<protocols::DimensionRange> ranges = protocols::ranges_of(block());
  std::vector<double> ends;
  for (std::size_t d = 0; d < ranges.size(); ++d) {
    if (block().dimensions[d].target.pointer != judged) continue;
    ends.push_back(ranges[d].min);
    ends.push_back(ranges[d].max);
  }
  std::ranges::sort(ends);
  return ends;
}

protocols::Interval TaskJudgement::standard_interval() const {
  const auto shown = std::ranges::find(trial_.intervals, true, &protocols::Interval::standard);
  protocols::Interval standard;
  standard.stimulus = *block().standard;
  if (!block().dimensions.empty() && shown != trial_.intervals.end()) standard = *shown;
  return standard;
}

int TaskJudgement::index_of(const char* name) const {
  const auto& answers = block().answers;
  const auto at = std::find_if(answers.begin(), answers.end(),
                               [name](const auto& answer) { return answer.name == name; });
  return static_cast<int>(at - answers.begin());
}

/// The noise with which the threshold of a forced choice lies where it is planned: the distance of
/// a threshold of 75 % from the standard is 0.6745 of it.
double TaskJudgement::planned_noise(double noise, double reference) const {
  if (settings_.threshold_log_ratio == 0 || block().task != TaskKind::compare) return noise;
  const int side = protocols::side_of_levels(protocol_, block());
  const double threshold = reference + side * kQuartile * noise;
  const double planned = threshold * std::exp(settings_.threshold_log_ratio);
  return std::max(side * (planned - reference) / kQuartile, 1e-3 * noise);
}

/// Standard deviation, in the level's unit.
double TaskJudgement::noise_of_difference(double reference) const {
  if (varied_path(block()) == "/orientation") return settings_.turn_sd;
  if (reference != 0) return planned_noise(settings_.weber * std::abs(reference), reference);
  const std::vector<double> levels = this->levels();
  if (levels.empty()) return 0;
  return settings_.weber * std::max(std::abs(levels.front()), std::abs(levels.back()));
}

/// The view of an interval.
struct TaskJudgement::Sight {
  bool felt = true;                            ///< the stimulus gives force
  std::optional<double> level = std::nullopt;  ///< none: nothing is seen of it
  double sd = 0, lag = 0;
};

TaskJudgement::Sight TaskJudgement::sight_of(const protocols::Interval& interval) const {
  Sight out;
  if (!protocol_.view || interval.stimulus < 0) return out;
  const TaskBlock& asked = block();
  const protocols::StimulusSpec shown = protocols::shown_stimulus(protocol_, asked, interval);
  out.felt = shown.felt;
  if (!shown.seen || !shown.seen->object || !protocols::is_seen(asked, interval)) return out;
  const double level = level_of(interval);
  const std::string pointer = varied_path(asked);
  double seen = level, blur = 0;
  if (pointer == "/stiffness_n_per_m") {
    seen = shown.seen->give_stiffness.value_or(level);
  } else if (is_length(pointer)) {
    seen = level * shown.seen->size_ratio;
    const double distance = glm::distance(protocol_.view->eye, protocol_.workspace.centre);
    blur = std::tan(shown.seen->blur_deg * kRadian) * distance * protocol_.workspace.scale;
  }
  out.felt = out.felt && !pointer.starts_with("/seen/");
  out.level = seen;
  out.sd = std::hypot(cues_.weber_v * seen, blur);
  out.lag = shown.seen->delay;
  return out;
}

/// Draws nothing where nothing is seen. \param sd  of the felt estimate
double TaskJudgement::with_sight(const protocols::Interval& interval, std::optional<double> felt,
                                 double sd) {
  const Sight sight = sight_of(interval);
  if (!sight.level) return felt.value_or(last_level_);
  if (!sight.felt) felt.reset();
  CueEstimates estimates;
  estimates.felt = felt;
  estimates.felt_sd = sd;
  estimates.seen = *sight.level + sight.sd * random_.normal();
  estimates.seen_sd = sight.sd;
  estimates.lag = sight.lag;
  if (const auto levels = this->levels(); !levels.empty())
    estimates.range = levels.back() - levels.front();
  if (!look_) look_ = random_.unit();
  estimates.looks = *look_ < weight_of_seen(sd, sight.sd);
  touched_ = true;
  return combined_estimate(cues_, estimates);
}

void TaskJudgement::feel(const protocols::Interval& interval, const Felt& given) {
  const Felt felt = protocol_.view ? Felt{std::nullopt, false, given.touched} : given;
  measured_ = felt.measured.has_value();
  touched_ = felt.touched;
  last_level_ = felt.measured.value_or(level_of(interval));
  double reference = last_level_;
  if (block().standard) reference = level_of(standard_interval());
  feels_standard_ = interval.standard;
  if (!felt.touched && block().task == TaskKind::adjust) {  // no answer is needed yet
    (interval.standard ? standard_ : own_).reset();
    return;
  }
  if (const auto levels = this->levels(); !felt.touched && !levels.empty())
    last_level_ = levels.front() + random_.unit() * (levels.back() - levels.front());
  const double sd = felt.noisy ? 0 : noise_of_difference(reference) / std::sqrt(2.0);
  const double less = interval.standard ? 0 : settings_.shift * noise_of_difference(reference);
  double estimate = last_level_ - less + sd * random_.normal();
  if (protocol_.view) {
    const auto touched = felt.touched ? std::optional<double>(estimate) : std::nullopt;
    estimate = with_sight(interval, touched, sd);
  }
  estimates_.push_back(estimate);
  (interval.standard ? standard_ : own_) = estimate;
  if (!interval.standard) shown_ = level_of(interval);
  noise_ = noise_of_difference(reference);
}

/// Index of the chosen interval.
std::optional<int> TaskJudgement::compared() {
  const TaskBlock& asked = block();
  if (estimates_.size() < 2) return std::nullopt;
  double reference = estimates_.front();
  if (asked.standard && !asked.dimensions.empty())
    reference = level_of(standard_interval());
  else if (asked.standard)
    reference = protocols::own_level(protocol_, asked, *asked.standard).value_or(reference);
  const double sd = std::max(1e-300, noise_of_difference(reference));
  if (asked.same_different) {
    evidence_ = std::abs(estimates_[0] - estimates_[1]) / sd;
    return index_of(evidence_ > 1 ? "different" : "same");
  }
  const auto [least, most] = std::minmax_element(estimates_.begin(), estimates_.end());
  evidence_ = (*most - *least) / sd;
  const auto at = (asked.asks_smaller ? least : most) - estimates_.begin();
  return index_of(std::to_string(at + 1).c_str());
}

int TaskJudgement::detected() {
  double yes = settings_.false_alarm;
  if (!trial_.catch_trial && touched_) {
    yes = 1 - settings_.lapse;
    if (!trial_.point.empty())
      yes = protocols::typical_success(
          protocol_, trial_,
          {settings_.threshold, settings_.spread, settings_.false_alarm, settings_.lapse});
    if (trial_.level) {
      const protocols::PsychometricParticipant typical = protocols::typical_participant(
          protocol_, block(),
          {settings_.threshold, settings_.spread, settings_.false_alarm, settings_.lapse});
      yes = protocols::psychometric_probability(
          typical.function, typical.parameters,
          *trial_.level * std::exp(-settings_.threshold_log_ratio));
    }
  }
  evidence_ = 4 * std::abs(yes - 0.5);
  return index_of(random_.unit() < yes ? "yes" : "no");
}

/// Feels the other interval first, then turns and feels again.
int TaskJudgement::adjusted() {
  if (!own_ || !standard_) return index_of("switch");
  const TaskBlock& asked = block();
  const double apart = *standard_ - *own_;
  if (std::abs(apart) <= std::max(asked.turn / 2, noise_)) return index_of("done");
  if (feels_standard_) return index_of("switch");
  const bool up = apart > 0;
  if (up ? shown_ >= *asked.most : shown_ <= *asked.least) return index_of("done");
  turns_ = static_cast<int>(std::max(1L, std::lround(std::min(std::abs(apart) / asked.turn, 1e6))));
  return index_of(up ? "up" : "down");
}

int TaskJudgement::identified() {
  int found = trial_.stimulus;
  evidence_ = 2;
  if (settings_.share_correct) {
    const auto& all = block().answers;
    const int right =
        index_of(base_name(protocol_.stimuli[static_cast<std::size_t>(found)].name).c_str());
    if (random_.unit() < *settings_.share_correct || all.size() < 2) return right;
    const auto count = static_cast<std::uint64_t>(all.size());
    return static_cast<int>((static_cast<std::uint64_t>(right) + 1 + random_.below(count - 1)) %
                            count);
  }
  if (measured_ && protocols::targets_of(block()).empty()) {
    const auto apart = [&](int stimulus) {
      const double own =
          protocol_.stimuli[static_cast<std::size_t>(stimulus)].object.material.stiffness;
      return std::abs(std::log(std::max(own, 1e-3) / std::max(estimates_.back(), 1e-3)));
    };
    found = *std::min_element(block().stimuli.begin(), block().stimuli.end(),
                              [&](int a, int b) { return apart(a) < apart(b); });
    evidence_ = std::max(0.0, 2 - apart(found) / settings_.weber);
  }
  return index_of(base_name(protocol_.stimuli[static_cast<std::size_t>(found)].name).c_str());
}

/// A step of a scale, from 0.
int TaskJudgement::rated(std::uint64_t steps) {
  const auto last = static_cast<double>(steps - 1);
  // The step nearest to the level's place among all levels.
  const std::vector<double> levels = this->levels();
  const double range = levels.empty() ? 0 : levels.back() - levels.front();
  const double place = range > 0 ? (estimates_.back() - levels.front()) / range : 0.5;
  double step = std::clamp(place, 0.0, 1.0) * last;
  if (settings_.rating_sd > 0)
    step = std::clamp(step + settings_.rating + settings_.rating_sd * random_.normal(), 0.0, last);
  return static_cast<int>(std::lround(step));
}

int TaskJudgement::answer() {
  const auto count = static_cast<std::uint64_t>(std::max<std::size_t>(1, block().answers.size()));
  if (block().task == TaskKind::adjust) return adjusted();
  if (block().task == TaskKind::detect) return detected();
  if (random_.unit() < settings_.lapse) return static_cast<int>(random_.below(count));
  switch (block().task) {
    case TaskKind::compare:
      return compared().value_or(0);
    case TaskKind::rate:
      return rated(count);
    default:
      return identified();
  }
}

double TaskJudgement::number() {
  const TaskBlock& asked = block();
  if (settings_.rating_sd > 0) {  // a rating without levels, as of a scale of seven steps
    const double middle =
        asked.least && asked.most ? (*asked.least + *asked.most) / 2 : asked.least.value_or(1) + 3;
    const double rated = middle + settings_.rating + settings_.rating_sd * random_.normal();
    return std::clamp(std::round(rated), asked.least.value_or(rated), asked.most.value_or(rated));
  }
  const bool of_period = varied_path(asked) == "/texture/period_m";
  const double exponent = of_period ? settings_.period_exponent : settings_.exponent;
  double scale = 10;
  if (asked.standard && asked.modulus > 0 && estimates_.size() > 1)
    scale = asked.modulus / std::pow(std::abs(estimates_.front()), exponent);
  const double judged = scale * std::pow(std::abs(last_level_), exponent) *
                        std::exp(settings_.number_sd * random_.normal());
  const double rounded = std::round(judged * 100) / 100;
  return std::clamp(rounded, asked.least.value_or(rounded), asked.most.value_or(rounded));
}

int TaskJudgement::confidence(int steps) const {
  const double share = std::min(evidence_ / 2, 0.999);
  return static_cast<int>(share * steps);
}

std::vector<std::string> unknown_shapes(const protocols::Protocol& protocol) {
  std::vector<std::string> out;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    for (std::size_t i = 0; block.by_shape && i < block.stimuli.size(); ++i) {
      const auto& stimulus = protocol.stimuli[static_cast<std::size_t>(block.stimuli[i])];
      const std::string fault = ShapeHypotheses::fault_of(stimulus.object);
      if (!fault.empty()) out.push_back("stimulus '" + stimulus.name + "': " + fault);
    }
  }
  return out;
}

BlockHypotheses block_hypotheses(const protocols::Protocol& protocol) {
  BlockHypotheses all;
  std::map<std::vector<int>, std::shared_ptr<const ShapeHypotheses>> known;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    all.emplace_back();
    if (!is_identified_by_shape(protocol, block)) continue;
    std::shared_ptr<const ShapeHypotheses>& shared = known[block.stimuli];
    if (!shared) {
      std::vector<stimuli::ObjectSpec> objects;
      for (const int stimulus : forms_of(protocol, block))
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
                                 int number, JudgementOf planned)
    : protocol_(protocol),
      hand_(own, hypotheses, stylus, protocol, seed, number),
      of_blocks_(of_blocks),
      reacher_({}, own.hand, stylus, protocol, seed, number),
      judgement_(protocol, {}, own.cues),
      planned_(std::move(planned)),
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
  return protocols::block_of(protocol_, trial_);
}

void TaskParticipant::begin_trial(const protocols::Trial& trial) {
  trial_ = trial;
  felt_ = 0;
  const auto& identified = of_blocks_[static_cast<std::size_t>(trial.task_block)];
  identifier_ = identified && !planned_ ? &identifiers_.at(identified.get()) : nullptr;
  if (planned_) judgement_.set(planned_now_ = planned_(number_, trial));
  judgement_.begin(trial, Random(seed_, {static_cast<std::uint64_t>(number_),
                                         static_cast<std::uint64_t>(trial.session),
                                         static_cast<std::uint64_t>(trial.trial), kJudgement}));
  if (!block().announced) begin_interval(trial_, {.shown = &trial_.intervals.front()});
}

void TaskParticipant::begin_interval(const protocols::Trial& trial, const IntervalView& view) {
  view_ = view;
  if (!view.felt) return;
  if (block().reaching) return reacher_.begin(trial);
  if (identifier_ != nullptr) return identifier_->begin_trial(trial);
  percept_.begin(trial, *view.shown);
  judged_ = false;
  limited_ = block().interval_limit.has_value();
  // Answer within the time limit.
  constexpr double kShareOfTime = 0.8;
  look_ = std::min(kLook, kShareOfTime * block().interval_limit.value_or(block().time_out));
  if (planned_) look_ = planned_now_.time.value_or(std::min(look_, kPlannedLook));
  protocols::Trial approach = trial;  // each interval has its own approach
  approach.trial = trial.trial * kMostIntervals + felt_++ % kMostIntervals;
  approach.renderer = view.shown->renderer;
  hand_.begin_trial(approach);
}

Answer TaskParticipant::answer(std::int64_t time_ns) {
  Answer given;
  given.time_ns = answered_ns_ = time_ns;
  if (!view_.answers) {
    given.continues = true;
  } else if (block().task == protocols::TaskKind::rate && block().answers.empty()) {
    given.number = judgement_.number();
  } else {
    given.stimulus = judgement_.answer();
    given.times = judgement_.turns();
  }
  return given;
}

/// The shape found is converted to an answer by its name.
std::optional<Answer> TaskParticipant::identify(const servo::Sample& sample) {
  std::optional<Answer> found = identifier_->step(sample);
  if (!found) return found;
  const int stimulus = forms_of(protocol_, block())[static_cast<std::size_t>(found->stimulus)];
  const std::string name = base_name(protocol_.stimuli[static_cast<std::size_t>(stimulus)].name);
  const auto& answers = block().answers;
  const auto at = std::find_if(answers.begin(), answers.end(),
                               [&](const auto& answer) { return answer.name == name; });
  found->stimulus = static_cast<int>(at - answers.begin());
  answered_ns_ = found->time_ns;
  return found;
}

std::optional<Answer> TaskParticipant::step(const servo::Sample& sample) {
  if (!view_.felt) return answer(sample.time_ns);
  if (block().reaching) {
    reacher_.step(sample);
    answered_ns_ = sample.time_ns;
    return std::nullopt;  // the movement answers
  }
  if (identifier_ != nullptr) return identify(sample);
  if (planned_) return step_as_planned(sample);
  hand_.step(sample);
  if (sample.phase != servo::Phase::feeling) return std::nullopt;
  percept_.add(sample);
  if (hand_.percept()) percept_.add(*hand_.percept());
  const double time = sample.tick * period_;
  const double longest = look_ < kLook ? look_ : kLongestLook;
  const bool felt = view_.shown->stimulus < 0 ||
                    protocol_.stimuli[static_cast<std::size_t>(view_.shown->stimulus)].felt;
  const bool enough = time >= look_ && (!felt || percept_.contact_ticks() * period_ >= look_ / 3);
  if (judged_ || (!enough && time < longest)) return std::nullopt;
  judged_ = true;
  const std::optional<double> length = percept_.length();
  judgement_.feel(*view_.shown, {length ? length : percept_.stiffness(), length.has_value(),
                                 percept_.contact_ticks() > 0});
  if (limited_) return std::nullopt;  // the answer is given afterwards, without forces
  return answer(sample.time_ns);
}

/// Keeps the hand's way, but judges the true level after the planned time.
std::optional<Answer> TaskParticipant::step_as_planned(const servo::Sample& sample) {
  hand_.step(sample);
  if (sample.phase != servo::Phase::feeling || judged_ || sample.tick * period_ < look_)
    return std::nullopt;
  judged_ = true;
  judgement_.feel(*view_.shown, {});
  if (limited_) return std::nullopt;
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

std::optional<std::string> TaskParticipant::ask(const protocols::PageSpec& page,
                                                const protocols::PageItem& item, const Asking&) {
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
