#include "runner/session/session_monitor.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "protocols/tasks/levels.h"
#include "runner/session/session_scenes.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {
namespace {

constexpr double kSecond_ns = 1e9;
constexpr std::int64_t kFrame_ns = 33'000'000;  // of the console
constexpr std::size_t kMostMessages = 200;

/// For the console; null: keep the text on show.
const char* in_words(Session::State state) {
  switch (state) {
    case Session::State::instruction:
      return "instructions";
    case Session::State::practice:
      return "practice begins";
    case Session::State::block:
      return "block begins";
    case Session::State::rest:
      return "rest";
    case Session::State::trial:
    case Session::State::response:
      return nullptr;
    case Session::State::end:
      return "end";
  }
  return "";
}

/// Whether answers judge the stimulus; a standard is felt only.
bool is_asked_for(const protocols::Protocol& protocol, int stimulus) {
  return std::ranges::any_of(protocol.blocks, [&](const protocols::TaskBlock& block) {
    return std::ranges::find(block.stimuli, stimulus) != block.stimuli.end();
  });
}

bool has_right_answers(const protocols::TaskBlock& block) {
  return block.task != protocols::TaskKind::rate && block.task != protocols::TaskKind::adjust;
}

std::string milliseconds(std::int64_t ns) {
  return std::to_string((ns + 500'000) / 1'000'000) + " ms";
}

}  // namespace

SessionMonitor::SessionMonitor(const LiveStation& station, const Sources& sources)
    : station_(station), sources_(sources), started_ns_(station.clock.now_ns()) {
  state_.study = station.protocol.name;
  state_.tool = tool_of(station.protocol.tool);
  state_.participant = station.record.participant().code;
  state_.session = station.record.session();
  for (std::size_t i = 0; i < station.protocol.stimuli.size(); ++i) {
    if (is_asked_for(station.protocol, static_cast<int>(i)))
      state_.scores.push_back({station.protocol.stimuli[i].name, 0, 0});
  }
  state_.counts_right = std::ranges::any_of(station.protocol.blocks, has_right_answers);
  state_.takes_answers = station.answer_by == participants::AnswerBy::experimenter;
  show_answers();
}

void SessionMonitor::show_answers() {
  state_.given.clear();
  for (data::PageAnswer& one : station_.record.answers()) {
    const bool consent = std::any_of(
        station_.protocol.pages.begin(), station_.protocol.pages.end(), [&](const auto& page) {
          return page.name == one.page && page.kind == protocols::PageSpec::Kind::consent;
        });
    if (!consent) state_.given.push_back({one.page, one.item, std::move(one.answer)});
  }
}

double SessionMonitor::elapsed() const {
  return static_cast<double>(station_.clock.now_ns() - started_ns_) / kSecond_ns;
}

void SessionMonitor::say(const std::string& message) {
  if (state_.messages.size() >= kMostMessages) {
    state_.messages.erase(state_.messages.begin());
    ++state_.older_messages;
  }
  state_.messages.push_back(message);
  show();
}

void SessionMonitor::show() {
  shown_ns_ = station_.clock.now_ns();
  const Session& session = sources_.session;
  const protocols::SessionPlan& plan = session.plan();
  state_.seconds_left = sources_.respondent.seconds_left();
  state_.elapsed = static_cast<double>(shown_ns_ - started_ns_) / kSecond_ns;
  const std::size_t expected = expected_trials();
  state_.trials = static_cast<int>(expected);
  state_.about = expected != plan.size();
  if (state_.trial == 0 && plan.done() > 0) {  // resumed, and no trial has begun yet
    state_.trial = static_cast<int>(plan.done());
    if (!plan.finished()) state_.block = plan.next().block;
  }
  state_.pauses = in_trial_ && sources_.hold.kind() == SessionHold::Kind::pause;
  state_.blocks = plan.last_block();
  state_.remaining = seconds_per_trial_ * static_cast<double>(expected - plan.done());
  state_.sample = sources_.forces.newest();
  state_.field_power.reset();
  if (feeling_ && session.field_power().measures())
    state_.field_power = session.field_power().watts();
  state_.bodies.clear();
  if (feeling_) {
    const auto bodies = station_.servo.bodies();
    state_.bodies.assign(bodies.begin(), bodies.end());
  }
  state_.fault = sources_.hold.fault();
  if (in_trial_) {
    state_.state = feeling_ ? "trial" : "homing";
  } else if (state_.held_by.empty() && !page_.empty()) {
    state_.state = page_;
  } else if (state_.held_by.empty() && in_words(session.state()) != nullptr) {
    state_.state = in_words(session.state());
  }
  const servo::ServoHealth& health = station_.servo_thread.health();
  state_.ticks = health.ticks();
  state_.missed_ticks = health.missed_ticks();
  state_.longest_period_ns = health.longest_period_ns();
  station_.console.show(state_);
}

std::size_t SessionMonitor::expected_trials() {
  const protocols::SessionPlan& plan = sources_.session.plan();
  if (expected_at_ != plan.done()) {
    expected_at_ = plan.done();
    expected_ = plan.expected_size();
  }
  return expected_;
}

void SessionMonitor::show_if_due() {
  if (station_.clock.now_ns() - shown_ns_ >= kFrame_ns) show();
}

void SessionMonitor::held() {
  state_.state = sources_.hold.state();
  state_.held_by = sources_.hold.held_by();
}

void SessionMonitor::count(const data::TrialRecord& record) {
  if (record.practice) return;
  for (display::ShapeScore& score : state_.scores) {
    if (score.shape != record.shape) continue;
    score.answered += record.timed_out ? 0 : 1;
    if (!data::has_right_answer(record)) continue;
    ++score.shown;
    score.right += record.correct ? 1 : 0;
  }
}

void SessionMonitor::interval(const protocols::Trial& trial,
                              const participants::IntervalView& view) {
  const auto& block = protocols::block_of(station_.protocol, trial);
  sources_.signals.interval(view.continues);
  feeling_ = feeling_ && view.continues;
  state_.task = to_string(block.task);
  state_.counts_right = has_right_answers(block);
  state_.level_name = block.level ? protocols::level_name(block.level->pointer) : "";
  state_.interval = view.interval;
  state_.intervals = view.intervals;
  state_.level.clear();
  const protocols::Interval* const shown = view.shown;
  std::vector<stimuli::ObjectSpec> objects;
  if (shown != nullptr) {
    state_.renderer = protocols::to_string(shown->renderer);
    if (shown->stimulus >= 0) objects.push_back(shown_object(station_.protocol, trial, *shown));
    for (std::size_t d = 0; d < shown->point.size(); ++d) {
      const protocols::LevelDimension& one = block.dimensions[d];
      if (!one.applies_to(shown->standard)) continue;
      state_.level += (state_.level.empty() ? "" : ", ") + one.name + " " +
                      protocols::number_in_words(one.target.pointer, shown->point[d]);
    }
    std::optional<double> level = shown->level;
    if (!level && block.level && shown->stimulus >= 0)
      level = protocols::own_level(station_.protocol, block, shown->stimulus);
    if (level) state_.level = protocols::level_in_words(block, *level);
  }
  state_.objects = std::make_shared<const std::vector<stimuli::ObjectSpec>>(std::move(objects));
  show();
}

void SessionMonitor::page(const PageView& view) {
  page_ = view.page.empty() ? ""
          : view.number == 0
              ? "page: " + view.page
              : "question " + std::to_string(view.number) + " of " +
                    std::to_string(view.questions) + ": " + view.page + ", " + view.question;
  show_answers();
  show();
}

void SessionMonitor::began(const protocols::Trial& trial) {
  const protocols::StimulusSpec& stimulus =
      station_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)];
  in_trial_ = true;
  feeling_ = touched_ = false;
  trial_began_ns_ = station_.clock.now_ns();
  stimuli::ObjectSpec object = stimulus.object;
  object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  state_.objects = std::make_shared<const std::vector<stimuli::ObjectSpec>>(1, std::move(object));
  state_.shape = stimulus.name;
  state_.practice = trial.practice;
  state_.renderer = protocols::to_string(trial.renderer);
  state_.block = trial.block;
  state_.trial = trial.trial;
  sources_.signals.began(trial);
  show();
}

void SessionMonitor::onset(const data::TrialRecord& so_far) {
  feeling_ = true;
  sources_.signals.onset(so_far);
}

void SessionMonitor::first_contact(const data::TrialRecord&, std::int64_t time_ns) {
  touched_ = true;
  sources_.signals.first_contact(time_ns);
}

void SessionMonitor::unrated(const data::TrialRecord& so_far) {
  const nlohmann::ordered_json event = {{"answered_before_confidence",
                                         {{"trial", so_far.trial},
                                          {"attempt", so_far.attempt},
                                          {"response", so_far.response},
                                          {"response_ns", so_far.response_ns}}}};
  station_.record.note(so_far.response_ns, event.dump());
}

void SessionMonitor::answered(const data::TrialRecord& record) {
  in_trial_ = asking_ = false;
  sources_.signals.answered(record);
}

void SessionMonitor::cut_off(const std::string& reason) {
  in_trial_ = asking_ = false;
  sources_.signals.cut_off();
  say("trial " + std::to_string(state_.trial) + " was cut off: " + reason);
}

/// For the experimenter; the record has every digit of an adjusted level.
std::string SessionMonitor::answer_in_words(const data::TrialRecord& record) const {
  if (!record.task.number || record.task.task != to_string(protocols::TaskKind::adjust))
    return record.response;
  const auto& blocks = station_.protocol.blocks;
  const auto block = std::find_if(
      blocks.begin(), blocks.end(),
      [&](const protocols::TaskBlock& one) { return one.name == record.task.block_name; });
  return block == blocks.end() ? record.response
                               : protocols::level_in_words(*block, *record.task.number);
}

void SessionMonitor::recorded(const data::TrialRecord& record) {
  state_.answer = record.timed_out ? "none in time" : answer_in_words(record);
  if (!record.timed_out && data::has_right_answer(record))
    state_.answer += record.correct ? ", right" : ", wrong";
  if (record.task.confidence)
    state_.answer += "; sure: " + protocols::level_text(*record.task.confidence);
  count(record);
  state_.times.push_back(record.response_time);
  const double took = static_cast<double>(station_.clock.now_ns() - trial_began_ns_) / kSecond_ns;
  ++timed_trials_;
  seconds_per_trial_ += (took - seconds_per_trial_) / timed_trials_;
  // A device with motors would have cut the trial off.
  if ((record.faults & servo::servo_fault::kMissedTicks) != 0)
    say("trial " + std::to_string(record.trial) + " missed " + std::to_string(record.missed_ticks) +
        (record.missed_ticks == 1 ? " tick, up to " : " ticks, up to ") +
        milliseconds(record.longest_period_ns) + " apart (recorded): the computer was busy");
  if (const auto& seen = record.task.seen; seen && seen->lag > data::SeenRecord::kMostLag)
    say("what is seen was " + milliseconds(std::llround(seen->lag * kSecond_ns)) +
        " late in trial " + std::to_string(record.trial) + ": people may notice 45 ms");
  if (const auto& heard = record.task.heard; heard && heard->lag > data::HeardRecord::kMostLag)
    say("contacts were heard " + milliseconds(std::llround(heard->lag * kSecond_ns)) +
        " late in trial " + std::to_string(record.trial) + ": people may notice 24 ms");
  if (!record.response.empty() && !touched_ && !record.task.catch_trial) {
    say("trial " + std::to_string(record.trial) + " was answered before the first contact");
  }
}

}  // namespace palpate::runner::session
