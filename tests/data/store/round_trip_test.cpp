#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

void expect_same(const TrialRecord& got, const TrialRecord& want) {
  EXPECT_EQ(got.session, want.session);
  EXPECT_EQ(got.block, want.block);
  EXPECT_EQ(got.trial, want.trial);
  EXPECT_EQ(got.attempt, want.attempt);
  EXPECT_EQ(got.renderer, want.renderer);
  EXPECT_EQ(got.shape, want.shape);
  EXPECT_EQ(got.response, want.response);
  EXPECT_EQ(got.correct, want.correct);
  EXPECT_EQ(got.practice, want.practice);
  EXPECT_EQ(got.timed_out, want.timed_out);
  EXPECT_EQ(got.orientation_wxyz, want.orientation_wxyz);
  EXPECT_EQ(got.response_time, want.response_time);
  EXPECT_EQ(got.first_contact_time, want.first_contact_time);
  EXPECT_EQ(got.onset_ns, want.onset_ns);
  EXPECT_EQ(got.response_ns, want.response_ns);
  EXPECT_EQ(got.start_tip, want.start_tip);
  EXPECT_EQ(got.start_tail, want.start_tail);
  EXPECT_EQ(got.ticks, want.ticks);
  EXPECT_EQ(got.missed_ticks, want.missed_ticks);
  EXPECT_EQ(got.longest_period_ns, want.longest_period_ns);
  EXPECT_EQ(got.faults, want.faults);
  EXPECT_EQ(got.started_inside, want.started_inside);
  EXPECT_EQ(got.max_force, want.max_force);
  EXPECT_EQ(got.contact_share, want.contact_share);
  EXPECT_EQ(got.edge_dwell, want.edge_dwell);
}

void expect_same(const RunInfo& got, const RunInfo& want) {
  EXPECT_EQ(got.session, want.session);
  EXPECT_EQ(got.clock.utc_ns, want.clock.utc_ns);
  EXPECT_EQ(got.clock.monotonic_ns, want.clock.monotonic_ns);
  EXPECT_EQ(got.program_version, want.program_version);
  EXPECT_EQ(got.build, want.build);
  EXPECT_EQ(got.device, want.device);
  EXPECT_EQ(got.device_calibration, want.device_calibration);
  EXPECT_EQ(got.response_device, want.response_device);
  EXPECT_EQ(got.response_latency, want.response_latency);
  EXPECT_EQ(got.observer_sha256, want.observer_sha256);
  EXPECT_EQ(got.consent_version, want.consent_version);
  EXPECT_EQ(got.consent_utc_ns, want.consent_utc_ns);
  EXPECT_EQ(got.hand, want.hand);
}

std::vector<StoredTrial> all_trials(Store& store, bool with_samples = false) {
  std::vector<StoredTrial> all;
  store.for_each_trial([&](const StoredTrial& trial) { all.push_back(trial); }, with_samples);
  return all;
}

TrialRecord unusual_record() {
  TrialRecord r = a_record(3, 2);
  r.block = 2147483647;
  r.practice = r.correct = r.started_inside = true;
  r.orientation_wxyz = {1.0 / 3.0, -std::numeric_limits<double>::denorm_min(), 0.1 + 0.2,
                        std::nextafter(1.0, 2.0)};
  r.response_time = 59.999999999999993;
  r.first_contact_time.reset();
  r.onset_ns = std::numeric_limits<std::int64_t>::max();
  r.response_ns = std::numeric_limits<std::int64_t>::min();
  r.start_tip = {1e-300, -2, 3};
  r.start_tail = {4, 5.5, -6e300};
  r.ticks = 1ull << 62;
  r.missed_ticks = 17;
  r.longest_period_ns = 123'456'789'012;
  r.faults = 0xFFFFFFFF;
  r.max_force = std::numeric_limits<double>::max();
  r.contact_share = 1.0 / 3.0;
  r.edge_dwell = 5e-324;
  return r;
}

TEST(StoreRoundTrip, EveryFieldOfATrial) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  const Participant person = store.enrol(a_protocol(), "P1");
  const palpate::data::Run run = store.begin_run(person, a_run(2));
  TrialRecord wrong = unusual_record();
  TrialRecord timed_out = a_record(4, 2);
  timed_out.timed_out = true;
  timed_out.response = "";
  for (const auto& record : {wrong, timed_out}) {
    ASSERT_EQ(store.begin_attempt(run, record, 1), 1);
    store.finish_attempt(run, record);
  }
  Store reader = Store::open(folder / "s.db", Store::Mode::read_only);
  const auto trials = all_trials(reader);
  ASSERT_EQ(trials.size(), 2u);
  expect_same(trials[0].record, wrong);
  expect_same(trials[1].record, timed_out);
  const auto progress = reader.progress(person, 2);
  ASSERT_EQ(progress.completed.size(), 2u);
  expect_same(progress.completed[0], wrong);
  expect_same(progress.completed[1], timed_out);
  EXPECT_EQ(progress.completed[1].onset_utc, trials[1].record.onset_utc);
}

TEST(StoreRoundTrip, CalendarOnsetFollowsFromTheRunsClock) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "P1"), a_run());
  TrialRecord record = a_record(1);
  record.onset_ns = a_run().clock.monotonic_ns + 61'000'002'000;
  record.onset_utc = "what a caller says is not taken";
  store.begin_attempt(run, record, 1);
  store.finish_attempt(run, record);
  EXPECT_EQ(all_trials(store).at(0).record.onset_utc, "2023-11-14T22:14:21.123458Z");
}

TEST(StoreRoundTrip, EveryFieldOfARunAndItsParticipant) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  RunInfo info = a_run(7);
  info.build = "gcc 12 -O2";
  info.device_calibration = "{\"k\": 1}";
  info.response_device = "keyboard";
  info.response_latency = 0.0125;
  info.consent_version = "2024-2";
  info.consent_utc_ns = -5;
  info.hand = "left";
  RunInfo simulated = a_run();
  simulated.observer_sha256 = std::string(64, 'f');
  const auto seed = std::numeric_limits<std::uint64_t>::max();
  store.begin_run(store.enrol(a_protocol(), "zoe", 12), info);
  const palpate::data::Run run =
      store.begin_run(store.enrol(a_protocol('b'), "S1", {}, true, seed), simulated);
  store.record_simulated(run, {a_record(1)});

  const auto runs = store.runs();
  ASSERT_EQ(runs.size(), 2u);
  expect_same(runs[0].info, info);
  EXPECT_EQ(runs[0].protocol_sha256, a_protocol().sha256);
  EXPECT_EQ(runs[0].participant.code, "zoe");
  EXPECT_EQ(runs[0].participant.number, 12);
  EXPECT_FALSE(runs[0].participant.simulated);
  EXPECT_EQ(runs[0].participant.seed, std::nullopt);
  EXPECT_EQ(runs[0].end, RunEnd::running);
  expect_same(runs[1].info, simulated);
  EXPECT_TRUE(runs[1].participant.simulated);
  EXPECT_EQ(runs[1].participant.seed, seed);
  const auto trial = all_trials(store).at(0);
  expect_same(trial.run, simulated);
  EXPECT_EQ(trial.participant.seed, seed);
  EXPECT_EQ(trial.protocol_name, "ho2000");
  EXPECT_EQ(trial.protocol_sha256, a_protocol('b').sha256);
}

TEST(StoreRoundTrip, SamplesKeepTheirTrialAndEveryBit) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "P1"), a_run());
  TrialRecord record = a_record(2);
  record.samples.resize(1500);
  for (std::uint32_t i = 0; i < 1500; ++i) record.samples[i].tick = i;
  record.samples[9].depth = std::bit_cast<double>(0x7FF800000000BEEFu);
  store.begin_attempt(run, a_record(1), 1);
  store.finish_attempt(run, a_record(1));
  store.begin_attempt(run, record, 1);
  store.finish_attempt(run, record);
  const auto trials = all_trials(store, true);
  EXPECT_TRUE(trials.at(0).record.samples.empty());
  ASSERT_EQ(trials.at(1).record.samples.size(), 1500u);
  EXPECT_EQ(trials[1].record.samples[1499].tick, 1499u);
  EXPECT_EQ(std::bit_cast<std::uint64_t>(trials[1].record.samples[9].depth), 0x7FF800000000BEEFu);
  EXPECT_TRUE(all_trials(store, false).at(1).record.samples.empty());
}

constexpr const char* kHostile[] = {"Robert'); DROP TABLE attempts;--",
                                    "\"",
                                    "a,b",
                                    "line\nbreak\r\n",
                                    "=HYPERLINK(\"http://x\")",
                                    "@SUM(1)",
                                    "\xEF\xBB\xBFmark",
                                    " ",
                                    "?1",
                                    "%s%n",
                                    "Würfel \xF0\x9F\xA7\x8A",
                                    "\x01\x1b[31m"};

TEST(StoreRoundTrip, HostileTextsAreOnlyTexts) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  for (const char* hostile : kHostile) {
    const std::string text = hostile;
    const Participant person =
        store.enrol({.name = text, .text = text, .sha256 = checksum_hex(text)}, "P1");
    RunInfo info = a_run();
    info.program_version = info.build = info.device = info.device_calibration =
        info.response_device = info.consent_version = info.hand = text;
    const palpate::data::Run run = store.begin_run(person, info);
    TrialRecord record = a_record(1);
    record.renderer = record.shape = record.response = text;
    store.begin_attempt(run, record, 1);
    store.cut_off_attempt(run, text);
    record.attempt = store.begin_attempt(run, record, 2);
    store.finish_attempt(run, record);
    store.add_note(run, 3, text);

    EXPECT_EQ(store.protocols().back().name, text);
    EXPECT_EQ(store.protocols().back().text, text);
    expect_same(store.runs().back().info, info);
    expect_same(all_trials(store).back().record, record);
    std::string reason;
    store.for_each_cut_off([&](const StoredTrial& trial) { reason = trial.cut_off_reason; });
    EXPECT_EQ(reason, text);
    EXPECT_EQ(store.notes().back().text, text);
  }
  EXPECT_EQ(store.counts().completed, static_cast<std::int64_t>(std::size(kHostile)));
}

TEST(StoreRoundTrip, NotesCarryTheirTime) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "P1"), a_run(3));
  store.add_note(run, a_run().clock.monotonic_ns, "stylus slipped");
  ASSERT_EQ(store.notes().size(), 1u);
  EXPECT_EQ(store.notes()[0].utc, "2023-11-14T22:13:20.123456Z");
  EXPECT_EQ(store.notes()[0].session, 3);
  EXPECT_EQ(store.notes()[0].participant.code, "P1");
}

TEST(StoreRoundTrip, InvalidValuesAreRefusedFieldByField) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  const Participant person = store.enrol(a_protocol(), "P1");
  const palpate::data::Run run = store.begin_run(person, a_run());
  store.begin_attempt(run, a_record(1), 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  TrialRecord record = a_record(1);
  record.response = std::string("co\0ne", 5);
  record.response_time = nan;
  record.first_contact_time = -std::numeric_limits<double>::infinity();
  record.start_tail[1] = nan;
  record.max_force = nan;
  record.contact_share = 1.0000000000000002;
  record.edge_dwell = nan;
  record.orientation_wxyz[2] = nan;
  record.ticks = 1ull << 63;
  const std::string error = error_of([&] { store.finish_attempt(run, record); });
  for (const char* field : {"response must", "response_time", "first_contact_time", "start_tail",
                            "max_force", "contact_share must be at most 1", "edge_dwell",
                            "orientation", "ticks", "s.db", "trial 1"}) {
    EXPECT_TRUE(contains(error, field)) << field << " in: " << error;
  }
  record = a_record(1);
  record.response_time = record.max_force = -1e-300;
  record.first_contact_time = -0.5;
  const std::string below = error_of([&] { store.finish_attempt(run, record); });
  for (const char* field : {"response_time", "first_contact_time", "max_force"}) {
    EXPECT_TRUE(contains(below, std::string(field) + " must not be below zero")) << below;
  }
  for (const std::string& text :
       {std::string("\0", 1), std::string("\xFF"), std::string("\xC0\x80"),
        std::string("\xED\xA0\x80"), std::string("\xF4\x90\x80\x80"), std::string("\xE2\x82")}) {
    EXPECT_THROW(store.add_note(run, 1, text), StoreRefused);
    TrialRecord plan = a_plan(2);
    plan.shape = text;
    EXPECT_THROW(store.begin_attempt(run, plan, 1), StoreRefused);
    RunInfo info = a_run(2);
    info.device_calibration = text;
    EXPECT_THROW(store.begin_run(person, info), StoreRefused);
    ProtocolInfo protocol = a_protocol('c');
    protocol.text = text;
    EXPECT_THROW(store.enrol(protocol, "P1"), StoreRefused);
  }
  EXPECT_EQ(store.counts().completed, 0);
  EXPECT_EQ(store.counts().protocols, 1);
  store.finish_attempt(run, a_record(1));  // the attempt is still open
}

}  // namespace
}  // namespace palpate::data
