// Each invalid value of a record is refused separately, and the message names it; the nearest valid
// value is stored.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "data/errors.h"
#include "data/export/csv.h"
#include "data/store/record_columns.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {
namespace refusals {

using namespace palpate::data::testing;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The message; "": no fault.
std::string message_of(const std::function<void(Validator&)>& validate_it) {
  Validator validator;
  validate_it(validator);
  try {
    validator.throw_if_invalid("it");
  } catch (const StoreRefused& refused) {
    return refused.what();
  }
  return "";
}

template <class Record>
struct Wrong {
  const char* named;
  std::function<void(Record&)> change;
};

TEST(Refusals, NameTheFieldOfAPlan) {
  const auto message = [](const TrialRecord& plan) {
    return message_of([&](Validator& validator) { validate_plan(validator, plan, 1); });
  };
  EXPECT_EQ(message(a_plan(3)), "");
  for (const auto& [named, change] : std::vector<Wrong<TrialRecord>>{
           {"session", [](auto& plan) { plan.session = 2; }},
           {"block", [](auto& plan) { plan.block = 0; }},
           {"trial", [](auto& plan) { plan.trial = 0; }},
           {"trial", [](auto& plan) { plan.trial = -4; }},
           {"renderer", [](auto& plan) { plan.renderer = ""; }},
           {"shape", [](auto& plan) { plan.shape = ""; }},
           {"shape", [](auto& plan) { plan.shape = "\xff"; }},
           {"orientation", [](auto& plan) { plan.orientation_wxyz[0] = kNan; }},
           {"orientation", [](auto& plan) { plan.orientation_wxyz[3] = kInfinite; }}}) {
    TrialRecord plan = a_plan(3);
    change(plan);
    const std::string text = message(plan);
    EXPECT_EQ(text.rfind("it: not stored: ", 0), 0U) << named;
    EXPECT_NE(text.find(named), std::string::npos) << text;
    EXPECT_EQ(text.find(';'), std::string::npos) << "one fault: " << text;
  }
  TrialRecord several = a_plan(3);
  several.block = 0;
  several.shape = "";
  EXPECT_EQ(message(several),
            "it: not stored: block must be 1 or more, not 0; shape must not be empty");
}

TEST(Refusals, NameTheFieldOfAnOutcome) {
  const auto message = [](const TrialRecord& record) {
    return message_of([&](Validator& validator) { validate_outcome(validator, record); });
  };
  EXPECT_EQ(message(a_record(3)), "");
  TrialRecord least = a_record(3);
  least.response_time = least.max_force = 0;
  least.first_contact_time = least.contact_share = 0;
  least.response = "";
  EXPECT_EQ(message(least), "");
  least.contact_share = 1;
  EXPECT_EQ(message(least), "");
  for (const auto& [named, change] : std::vector<Wrong<TrialRecord>>{
           {"response", [](auto& r) { r.response = std::string("a\0b", 3); }},
           {"response_time", [](auto& r) { r.response_time = -1e-9; }},
           {"response_time", [](auto& r) { r.response_time = kNan; }},
           {"response_time", [](auto& r) { r.response_time = kInfinite; }},
           {"first_contact_time", [](auto& r) { r.first_contact_time = -1e-9; }},
           {"first_contact_time", [](auto& r) { r.first_contact_time = kInfinite; }},
           {"start_tip", [](auto& r) { r.start_tip[0] = kNan; }},
           {"start_tip", [](auto& r) { r.start_tip[2] = kNan; }},
           {"start_tail", [](auto& r) { r.start_tail[1] = kInfinite; }},
           {"max_force", [](auto& r) { r.max_force = -0.001; }},
           {"contact_share", [](auto& r) { r.contact_share = 1.0001; }},
           {"contact_share", [](auto& r) { r.contact_share = -0.0001; }}}) {
    TrialRecord record = a_record(3);
    change(record);
    EXPECT_NE(message(record).find(named), std::string::npos) << named << ": " << message(record);
  }
}

TEST(Refusals, NameTheFieldOfARun) {
  const auto message = [](const RunInfo& run, bool simulated) {
    return message_of([&](Validator& validator) { validate(validator, run, simulated); });
  };
  EXPECT_EQ(message(a_run(), false), "");
  for (const auto& [named, change] : std::vector<Wrong<RunInfo>>{
           {"session", [](auto& run) { run.session = 0; }},
           {"program version", [](auto& run) { run.program_version = ""; }},
           {"device", [](auto& run) { run.device = ""; }},
           {"build", [](auto& run) { run.build = "\x80"; }},
           {"device calibration", [](auto& run) { run.device_calibration = "\xc0\x80"; }},
           {"response device", [](auto& run) { run.response_device = "\xed\xa0\x80"; }},
           {"consent version", [](auto& run) { run.consent_version = "\xf5\x80\x80\x80"; }},
           {"hand", [](auto& run) { run.hand = "\xe2\x82"; }},
           {"response latency", [](auto& run) { run.response_latency = kNan; }},
           {"observer", [](auto& run) { run.observer_sha256 = "ab"; }}}) {
    RunInfo run = a_run();
    change(run);
    EXPECT_NE(message(run, false).find(named), std::string::npos) << named;
  }
  RunInfo simulated = a_run();
  simulated.observer_sha256 = "ab";
  EXPECT_EQ(message(simulated, true), "");
  EXPECT_NE(message(simulated, false), "") << "a human has no observer settings";
}

TEST(Refusals, NameTheFieldOfAnAnswer) {
  PageAnswer good;
  good.page = "consent";
  good.item = "agree";
  good.text_sha256 = std::string(64, 'a');
  const auto message = [](const PageAnswer& answer) {
    return message_of([&](Validator& validator) { validate(validator, answer); });
  };
  EXPECT_EQ(message(good), "");
  for (const auto& [named, change] :
       std::vector<Wrong<PageAnswer>>{{"page", [](auto& a) { a.page = ""; }},
                                      {"item", [](auto& a) { a.item = ""; }},
                                      {"version", [](auto& a) { a.version = "\xff"; }},
                                      {"answer", [](auto& a) { a.answer = "\xff"; }},
                                      {"text_sha256", [](auto& a) { a.text_sha256.pop_back(); }},
                                      {"text_sha256", [](auto& a) { a.text_sha256 += 'a'; }}}) {
    PageAnswer answer = good;
    change(answer);
    EXPECT_NE(message(answer).find(named), std::string::npos) << named;
  }
}

// The Unicode Standard, table 3-7: first and last of each row, and their invalid neighbours.
TEST(CleanUtf8, IsWellFormedAndHasNoNul) {
  for (const char* good :
       {"", "a", "\x7f", "\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xec\xbf\xbf", "\xed\x80\x80",
        "\xed\x9f\xbf", "\xee\x80\x80", "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf1\x80\x80\x80",
        "\xf3\xbf\xbf\xbf", "\xf4\x80\x80\x80", "\xf4\x8f\xbf\xbf"})
    EXPECT_TRUE(is_clean_utf8(good)) << good;
  for (const char* bad :
       {"\x80", "\xbf", "\xc0\x80", "\xc1\xbf", "\xc2", "\xc2\x7f", "\xc2\xc0", "\xe0\x9f\xbf",
        "\xe0\xa0", "\xe0\xa0\x7f", "\xed\xa0\x80", "\xef\xbf\xc0", "\xf0\x8f\xbf\xbf",
        "\xf0\x90\x80", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff", "a\xe0"})
    EXPECT_FALSE(is_clean_utf8(bad)) << bad;
  EXPECT_FALSE(is_clean_utf8(std::string_view("a\0b", 3)));
}

class StoreRefusals : public StoreOnDisk {};

TEST_F(StoreRefusals, AnAttemptIsCutOffForAReason) {
  Store store = open();
  const auto run = store.begin_run(store.enrol(a_protocol(), "P1"), a_run());
  store.begin_attempt(run, a_plan(1), 6'000'000'000);
  for (const char* reason : {"", "\xff"})
    EXPECT_THROW(store.cut_off_attempt(run, reason), StoreRefused) << reason;
  store.cut_off_attempt(run, "device fault");
  EXPECT_THROW(store.cut_off_attempt(run, "device fault"), StoreRefused) << "none is open";
}

TEST_F(StoreRefusals, SimulatedTrialsNeedAPlanOfTheirSession) {
  Store store = open();
  const auto run = store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
  TrialRecord other_session = a_record(1), no_shape = a_record(1), no_number = a_record(1);
  other_session.session = run.session + 1;
  no_shape.shape = "";
  no_number.trial = 0;
  for (const TrialRecord& record : {other_session, no_shape, no_number})
    EXPECT_THROW(store.record_simulated(run, {record}), StoreRefused);
  store.record_simulated(run, {a_record(1)});
}

TEST_F(StoreRefusals, AnExportTellsOfEvery16thTrial) {
  Store store = open();
  const auto run = store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
  std::vector<TrialRecord> records;
  for (int trial = 1; trial <= 40; ++trial) records.push_back(a_record(trial));
  store.record_simulated(run, records);
  std::vector<std::int64_t> told;
  ExportSettings settings;
  settings.progress = [&](std::int64_t trials) { told.push_back(trials); };
  export_csv(store, folder_ / "out.csv", settings);
  EXPECT_EQ(told, (std::vector<std::int64_t>{16, 32}));
}

}  // namespace refusals
}  // namespace
}  // namespace palpate::data
