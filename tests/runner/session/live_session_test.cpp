// A live session: its marks, pages, accepted answers and markers.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/runner/fake_device.h"
#include "tests/runner/session/live_session_case.h"

namespace palpate::runner::session {
namespace {

using runner::testing::FakeDevice;
using testing::at;
using testing::LiveSessions;

TEST_F(LiveSessions, FirstContactIsMarkedAndAnAnswerBeforeItHasNone) {
  screen_.answers = false;
  FakeDevice device([&](int tick) {
    if (tick == 60) screen_.answers = true;
    return at(tick < 30 || tick > 64 ? 0.1 : 0.019);
  });
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  const std::vector<data::TrialRecord> both = records();
  ASSERT_EQ(both.size(), 2u);
  ASSERT_TRUE(both[0].first_contact_time.has_value());
  EXPECT_LT(*both[0].first_contact_time, both[0].response_time);
  EXPECT_FALSE(both[1].first_contact_time.has_value());
  EXPECT_EQ(both[1].response, "ball");
  std::string kinds;
  for (const Marker& marker : markers_) kinds += std::string(to_string(marker.kind)) + " ";
  EXPECT_EQ(kinds, "trial_start first_contact response trial_start response ");
  EXPECT_EQ(markers_[1].time_ns - markers_[0].time_ns,
            std::llround(*both[0].first_contact_time * 1e9));
}

TEST_F(LiveSessions, EveryTrialAsksForTheSameDistanceWhateverItsShape) {
  protocol_.home.rest = 0.4;
  std::atomic<bool> far{false};
  std::vector<std::set<std::string>> seen;  // texts of the page, in each trial
  screen_.answers = false;
  screen_.shown = [&](const display::Page& page) {
    if (page.kind == display::Page::Kind::neutral && page.text.empty()) {
      far = screen_.answers = false;
      seen.emplace_back();
    }
    if (page.text == protocol_.texts.move_away) far = true;
    if (page.go) screen_.answers = true;
    if (!seen.empty() && !page.text.empty()) seen.back().insert(page.text);
  };
  // At 30 mm, the ball alone would let its trial begin.
  FakeDevice device([&](int) { return at(far ? 0.1 : 0.03); });
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  ASSERT_EQ(seen.size(), 2u);
  const auto& texts = protocol_.texts;
  for (const auto& said : seen)
    EXPECT_EQ(said, (std::set<std::string>{texts.move_away, texts.ready, texts.go}));
}

TEST_F(LiveSessions, UnusedKeysGetAReply) {
  std::atomic<bool> plugged{true};
  FakeDevice device([&](int) { return at(0.1, !plugged); });
  screen_.answers = false;
  screen_.shown = [&](const display::Page& page) {
    if (page.go && page.reply.empty() && plugged && !screen_.answers) screen_.wrong_key = "x";
    if (page.go && !page.reply.empty() && !screen_.answers) plugged = false;
  };
  console_.repair = [&] { plugged = screen_.answers = true; };
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  const auto has = [&](const auto& what) {
    return std::any_of(screen_.pages.begin(), screen_.pages.end(), what);
  };
  EXPECT_TRUE(
      has([&](const display::Page& p) { return p.go && p.reply == protocol_.texts.other_key; }));
  EXPECT_TRUE(has([&](const display::Page& p) {
    return p.kind == display::Page::Kind::message && p.text == protocol_.texts.wait;
  }));
}

TEST_F(LiveSessions, ABreakCountsDownAndTheConsoleShowsTheAnswer) {
  protocol_.breaks.every_trials = 1;
  protocol_.breaks.min_seconds = 2;
  protocol_.response.labels["ball"] = "Kugel";
  FakeDevice device([](int) { return at(0.1); });
  EXPECT_EQ(run(device).end, data::RunEnd::done);
  std::vector<int> counted;
  for (const display::Page& page : screen_.pages) {
    if (page.seconds_left == 0) continue;
    counted.push_back(page.seconds_left);
    EXPECT_EQ(page.done, 1);
    EXPECT_EQ(page.trials, 2);
  }
  EXPECT_EQ(counted, (std::vector<int>{2, 1}));
  const auto trial = std::find_if(screen_.pages.begin(), screen_.pages.end(),
                                  [](const display::Page& page) { return !page.keys.empty(); });
  ASSERT_NE(trial, screen_.pages.end());
  EXPECT_EQ(trial->keys[0], std::pair(std::string("1"), std::string("Kugel")));
  for (const data::TrialRecord& record : records()) EXPECT_EQ(record.response, "ball");
  EXPECT_EQ(console_.last.answer.substr(0, 6), "ball, ");
  ASSERT_EQ(console_.last.scores.size(), 2u);
  EXPECT_EQ(console_.last.scores[0].right + console_.last.scores[1].right, 1);
  EXPECT_EQ(console_.last.scores[0].shown + console_.last.scores[1].shown, 2);
}

TEST_F(LiveSessions, ButtonsAnswerAtTheirTickUnlessHeldFromBefore) {
  FakeDevice device([](int tick) {  // button 1 is stuck, button 2 is pressed every 40 ticks
    return at(0.1, false, static_cast<std::uint8_t>(1 + (tick % 40 > 35 ? 2 : 0)));
  });
  screen_.answers = false;
  EXPECT_EQ(run(device, participants::AnswerBy::buttons).end, data::RunEnd::done);
  ASSERT_EQ(records().size(), 2u);
  for (const data::TrialRecord& record : records()) EXPECT_EQ(record.response, "box");
}

TEST_F(LiveSessions, UndeliveredMarkersAreCountedWithoutDelay) {
  struct Never final : MarkerSink {
    bool send(const Marker&) noexcept override { return false; }
  };
  std::vector<std::unique_ptr<MarkerSink>> sinks;
  sinks.push_back(std::make_unique<Never>());
  std::optional<Markers> markers(std::in_place, std::move(sinks));
  for (int i = 0; i < 10; ++i) markers->send({});
  while (markers->dropped() < 10) clock_.wait_until(clock_.now_ns() + 1'000'000);
  EXPECT_EQ(markers->dropped(), 10u);
}

}  // namespace
}  // namespace palpate::runner::session
