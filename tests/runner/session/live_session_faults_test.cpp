// A live session with a device, guard or headphones that fail: trials are cut off and shown again.

#include <gtest/gtest.h>

#include <atomic>

#include "tests/runner/fake_device.h"
#include "tests/runner/session/live_session_case.h"

namespace palpate::runner::session {
namespace {

using runner::testing::FakeDevice;
using testing::at;
using testing::LiveSessions;

TEST_F(LiveSessions, RepeatsATrialThatALostDeviceCutOff) {
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int tick) {
    if (tick == 30) plugged = false;  // in the first trial
    return at(0.1, !plugged);
  });
  screen_.answers = false;
  console_.repair = [&] { plugged = screen_.answers = true; };
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::done);
  EXPECT_EQ(outcome.recorded, 2u);
  EXPECT_GE(console_.faults, 1);
  ASSERT_GE(cut_off_reasons().size(), 1u);
  EXPECT_NE(cut_off_reasons()[0].find("the device is unplugged"), std::string::npos);
  ASSERT_EQ(records().size(), 2u);
  EXPECT_GE(records()[0].attempt, 2);
  EXPECT_EQ(device.force, Vec3(0));
}

TEST_F(LiveSessions, AClearedFaultStaysCleared) {
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int tick) {
    if (tick == 30) plugged = false;
    return at(0.1, !plugged);
  });
  screen_.answers = false;
  int tries = 0;
  console_.repair = [&] {
    if (++tries == 3) plugged = screen_.answers = true;
  };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  int cleared = 0, refused = 0;
  for (const std::string& message : console_.last.messages) {
    cleared += message.find("fault cleared") == 0 ? 1 : 0;
    refused += message.find("not cleared, forces stay off: the device is unplugged") == 0 ? 1 : 0;
  }
  EXPECT_EQ(cleared, tries - 2) << "also where a busy machine has made it more";
  EXPECT_EQ(refused, 2);
  EXPECT_TRUE(has_note("fault cleared"));
}

TEST_F(LiveSessions, ADeviceUnpluggedInABreakIsReportedInTheBreak) {
  protocol_.breaks.every_trials = 1;
  protocol_.texts.break_text = "Rest.";
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int) { return at(0.1, !plugged); });
  screen_.takes_ns = 150'000'000;
  std::string state, fault;
  screen_.shown = [&](const display::Page& page) {
    if (page.text == "Rest." && fault.empty()) plugged = false;
  };
  console_.shown = [&](const display::ConsoleState& now) {
    if (!fault.empty() || now.fault.empty()) return;
    state = now.state;
    fault = now.fault;
    plugged = true;
    console_.next = {{display::ConsoleCommand::Kind::clear_fault, "", 0},
                     {display::ConsoleCommand::Kind::resume, "", 0}};
  };
  const LiveSession::Outcome outcome = run(device);
  EXPECT_EQ(outcome.end, data::RunEnd::done);
  EXPECT_EQ(outcome.recorded, 2u);
  EXPECT_EQ(state, "rest");
  EXPECT_NE(fault.find("the device is unplugged"), std::string::npos) << fault;
  EXPECT_TRUE(cut_off_reasons().empty()) << "no trial was begun without a device";
}

TEST_F(LiveSessions, AFaultNamesItsReasonAndTheNextStep) {
  FakeDevice device([&](int tick) { return at(0.1, tick > 30); });
  screen_.answers = console_.clears = false;
  console_.in_fault = {display::ConsoleCommand::Kind::stop_after_trial, "", 0};
  std::string held;
  console_.in_fault_sees = &held;
  run(device);
  EXPECT_EQ(held,
            "the device was lost: the device is unplugged: plug it in again; to continue: 'other', "
            "then 'on'");
}

TEST_F(LiveSessions, LateGuardsPauseAndEndedOnesEnd) {
  std::atomic<servo::DeviceTrouble> trouble{servo::DeviceTrouble::none};
  FakeDevice device([&](int tick) {
    if (tick == 30) trouble = servo::DeviceTrouble::guard_late;
    servo::DeviceReading reading = at(0.1, trouble != servo::DeviceTrouble::none);
    reading.trouble = trouble;
    return reading;
  });
  screen_.answers = false;
  console_.resumes = true;
  console_.clears = false;
  console_.repair = [&] {
    EXPECT_EQ(console_.last.held_by,
              "the guard process was late: the machine may be busy; to continue: 'on'");
    EXPECT_EQ(device.force, Vec3(0));
    trouble = servo::DeviceTrouble::none;
    screen_.answers = true;
  };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  EXPECT_EQ(console_.pauses, 1);

  participant_ = store_->enrol({protocol_.name, protocol_.source_text, protocol_.sha256}, "P02");
  screen_.answers = false;
  FakeDevice dying([&](int tick) {
    servo::DeviceReading reading = at(0.1, tick >= 30);
    if (tick >= 30) reading.trouble = servo::DeviceTrouble::guard_lost;
    return reading;
  });
  const LiveSession::Outcome outcome = run(dying);
  EXPECT_EQ(outcome.end, data::RunEnd::aborted);
  EXPECT_TRUE(outcome.failed);
  EXPECT_NE(outcome.reason.find("start the program again"), std::string::npos);
  EXPECT_EQ(dying.force, Vec3(0));
}

/// Shared with the player's thread, which outlives a test's local variables.
using Plugged = std::shared_ptr<std::atomic<bool>>;

/// Accepts everything until unplugged.
class Headphones final : public sound::SoundOutput {
 public:
  explicit Headphones(Plugged plugged) : plugged_(std::move(plugged)) {}
  double rate() const override { return 8000; }
  sound::SoundBuffer buffer() const override { return {160, 2}; }
  void wait() override {}
  int write(std::span<const std::int16_t>) override {
    if (!*plugged_) throw sound::SoundError("pulled out");
    return 0;
  }
  double latency() override { return 0; }

 private:
  const Plugged plugged_;
};
TEST_F(LiveSessions, LostHeadphonesCutOffTheTrialAndPause) {
  const Plugged plugged = std::make_shared<std::atomic<bool>>(true);
  sound::SoundSettings settings{.device = "headphones", .noise = protocols::MaskingNoise{}};
  settings.open = [plugged](const std::string&,
                            const sound::SoundBuffer&) -> std::unique_ptr<sound::SoundOutput> {
    if (!*plugged) throw sound::SoundError("no headphones");
    return std::make_unique<Headphones>(plugged);
  };
  sound_ = std::make_unique<sound::SoundPlayer>(std::move(settings));
  FakeDevice device([&](int tick) {
    if (tick == 30) *plugged = false;  // in the first trial
    return at(0.1);
  });
  screen_.answers = false;
  console_.resumes = true;
  console_.repair = [&] {  // at the second try
    if (console_.pauses == 2) *plugged = screen_.answers = true;
  };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  EXPECT_GE(console_.pauses, 2);
  ASSERT_GE(cut_off_reasons().size(), 1u);
  EXPECT_EQ(cut_off_reasons()[0], "the sound stopped");
  std::vector<std::string> events;
  for (const data::StoredNote& note : store_->notes()) {
    if (note.text.find("masking_noise") != std::string::npos) events.push_back(note.text);
  }
  ASSERT_EQ(events.size(), 4u);
  EXPECT_NE(events[0].find("\"on\",\"kind\":\"pink\",\"level_db\":-24.0"), std::string::npos);
  EXPECT_NE(events[1].find("\"trouble\":\"pulled out\""), std::string::npos);
  EXPECT_NE(events[2].find("\"on\""), std::string::npos);
  EXPECT_EQ(events[3].find("trouble"), std::string::npos);
}

}  // namespace
}  // namespace palpate::runner::session
