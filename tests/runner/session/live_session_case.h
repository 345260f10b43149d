#pragma once
// A live session in this process: person and console are scripts.

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocols/parse.h"
#include "runner/servo/realtime.h"
#include "runner/session/live_session.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::session::testing {

// 100 Hz, so that even a busy machine does not miss five ticks in a row.
constexpr const char* kProtocol = R"({"version": 1, "name": "live", "renderers": ["point"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
              {"name": "box", "shape": "cube", "edge_m": 0.03}],
  "repetitions": 1, "servo": {"rate_hz": 100}, "home": {"rest_s": 0.05},
  "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 30}})";

/// Answers "1" as soon as a trial may be answered, again and again.
class Screen final : public display::ParticipantScreen {
 public:
  explicit Screen(servo::Clock& clock) : clock_(clock) {}
  void show(const display::Page& page) override {
    kind = page.kind;
    shown_ns_ = clock_.now_ns();
    texts.push_back(page.text);
    if (kind == display::Page::Kind::feedback && on_feedback) on_feedback();
    pages.push_back(page);
    if (shown) shown(page);
  }
  std::vector<display::KeyPress> keys() override {
    if (pressed) return pressed();
    if (!wrong_key.empty()) return {{std::exchange(wrong_key, {}), clock_.now_ns()}};
    if (clock_.now_ns() < shown_ns_ + takes_ns) return {};
    if (kind == display::Page::Kind::text) return {{"space", clock_.now_ns()}};
    if (kind == display::Page::Kind::neutral && answers) return {{"1", clock_.now_ns()}};
    return {};
  }
  bool open() const override { return is_open; }
  display::Page::Kind kind = display::Page::Kind::message;
  std::vector<std::string> texts;
  std::vector<display::Page> pages;
  std::function<void(const display::Page&)> shown;
  std::function<std::vector<display::KeyPress>()> pressed;  ///< instead of everything else
  std::string wrong_key;                                    ///< pressed once
  std::atomic<bool> answers{true};
  std::int64_t takes_ns = 0;  ///< to read or to answer
  std::function<void()> on_feedback;
  bool is_open = true;

 private:
  servo::Clock& clock_;
  std::int64_t shown_ns_ = 0;
};

/// Clears every fault and continues, unless set otherwise.
class Console final : public display::ExperimenterConsole {
 public:
  explicit Console(servo::Clock& clock) : clock_(clock) {}
  void show(const display::ConsoleState& state) override {
    last = state;
    if (shown) shown(state);
  }
  std::vector<display::ConsoleCommand> commands() override {
    std::vector<display::ConsoleCommand> out = std::exchange(next, {});
    if (in_state && in_state->first == last.state)
      out.push_back(std::exchange(in_state, std::nullopt)->second);
    if (last.state == "paused" && resumes) {
      ++pauses;
      if (repair) repair();
      out.push_back({display::ConsoleCommand::Kind::resume, "", clock_.now_ns()});
    }
    if (last.state == "fault" && in_fault) {
      if (in_fault_sees != nullptr) *in_fault_sees = last.held_by;
      out.push_back(*std::exchange(in_fault, std::nullopt));
    } else if (last.state == "fault" && !clears && ++ignored > 1000) {
      out.push_back({display::ConsoleCommand::Kind::quit, "not obeyed", clock_.now_ns()});
    } else if (last.state == "fault" && clears) {
      ++faults;
      if (repair) repair();
      out.push_back({display::ConsoleCommand::Kind::clear_fault, "", clock_.now_ns()});
      out.push_back({display::ConsoleCommand::Kind::resume, "", clock_.now_ns()});
    }
    return out;
  }
  std::string name_of(display::ConsoleCommand::Kind kind) const override {
    return kind == display::ConsoleCommand::Kind::resume ? "'on'" : "'other'";
  }
  display::ConsoleState last;
  std::function<void(const display::ConsoleState&)> shown;
  std::vector<display::ConsoleCommand> next;
  std::function<void()> repair;
  bool resumes = false;                             ///< after a pause
  bool clears = true;                               ///< faults
  std::optional<display::ConsoleCommand> in_fault;  ///< sent once
  std::string* in_fault_sees = nullptr;             ///< the reason shown at that time
  /// Sent once, in this state.
  std::optional<std::pair<std::string, display::ConsoleCommand>> in_state;
  int pauses = 0;
  int faults = 0;
  int ignored = 0;  ///< polls of the console after `in_fault`

 private:
  servo::Clock& clock_;
};

class Collected final : public MarkerSink {
 public:
  explicit Collected(std::vector<Marker>& to) : to_(to) {}
  bool send(const Marker& marker) noexcept override {
    to_.push_back(marker);
    return true;
  }

 private:
  std::vector<Marker>& to_;
};

class LiveSessions : public ::testing::Test {
 protected:
  LiveSessions() {
    store_.emplace(data::Store::open(folder_ / "live.db", data::Store::Mode::write_or_create));
    participant_ = store_->enrol(info_of(protocol_), "P01");
  }

  LiveSession::Outcome run(servo::Device& device,
                           participants::AnswerBy by = participants::AnswerBy::keys) {
    servo::ServoSettings settings;
    settings.rate = protocol_.servo_rate;
    settings.realtime.lock_memory = false;
    servo::ServoThread servo(device, clock_, settings);
    data::RunInfo info;
    info.program_version = "0.0.0";
    info.device = "fake";
    protocols::SessionPlan plan(protocol_, participant_.number, 1);
    for (const data::TrialRecord& r : store_->progress(participant_, 1).completed)
      plan.answered({r.correct, r.correct});
    std::vector<std::unique_ptr<MarkerSink>> sinks;
    sinks.push_back(std::make_unique<Collected>(markers_));
    Markers markers(std::move(sinks));
    RunRecord record(*store_, info_of(protocol_), participant_, info);
    record.begin();
    const LiveStation station{
        {protocol_, library_, plan, servo, clock_, {0, 0}, record, nullptr, sound_.get()},
        record,
        device.capabilities(),
        nullptr,
        servo,
        nullptr,
        [this] { return signal_; },
        screen_,
        console_,
        by,
        markers};
    return LiveSession(station).run();
  }

  bool has_note(const std::string& text) {
    const std::vector<data::StoredNote> notes = store_->notes();
    return std::any_of(notes.begin(), notes.end(),
                       [&text](const data::StoredNote& note) { return note.text == text; });
  }
  std::vector<data::TrialRecord> records() { return store_->progress(participant_, 1).completed; }
  std::vector<std::string> cut_off_reasons() {
    std::vector<std::string> out;
    store_->for_each_cut_off([&](const data::StoredTrial& t) { out.push_back(t.cut_off_reason); });
    return out;
  }

  protocols::Protocol protocol_ = protocols::parse_protocol_text(kProtocol, "live.json");
  StimulusLibrary library_{protocol_};
  const palpate::testing::TemporaryFolder folder_;
  servo::RealClock clock_;
  Screen screen_{clock_};
  Console console_{clock_};
  std::vector<Marker> markers_;
  int signal_ = 0;
  std::unique_ptr<sound::SoundPlayer> sound_;
  std::optional<data::Store> store_;
  data::Participant participant_;
};

inline servo::DeviceReading at(double x, bool lost = false, std::uint8_t buttons = 0) {
  servo::DeviceReading reading{{{x, 0, 0}, {x, 0, 0.12}}, buttons, lost};
  if (lost) reading.trouble = servo::DeviceTrouble::unplugged;
  return reading;
}

}  // namespace palpate::runner::session::testing
