#include "data/export/csv.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "data/base/checksum.h"
#include "data/files/text_sink.h"
#include "data/store/task_text.h"
#include "tests/data/export/csv_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

TEST_F(ExportCsv, AlwaysHasTheSameColumns) {
  export_csv(store_, out_, false);
  EXPECT_EQ(
      contents_of(out_),
      "participant_id,session,block,trial,renderer,shape,response,correct,response_time,"
      "orientation_w,orientation_x,orientation_y,orientation_z,practice,timed_out,"
      "first_contact_time,onset_utc,device,simulated,missed_ticks,attempt,protocol_sha256,"
      "program_version,participant_number,started_inside,ticks,longest_period,faults,max_force,"
      "observer_sha256,before_contact,response_device,contact_share,edge_dwell\r\n");
}

TEST_F(ExportCsv, LeftOutTorqueHasItsOwnColumn) {
  show(a_record(3));
  TrialRecord point = a_record(4);
  point.renderer = "point";
  show(point);
  store_.add_note(run_, 0, "torque was left out, the participant says");
  ExportSettings settings;
  settings.force = true;
  export_csv(store_, out_, settings);
  EXPECT_FALSE(by_name(rows(), 1).contains("torque_driven")) << "no session left it out";
  store_.add_note(run_, 0, kTorqueLeftOutNote);
  const palpate::data::Run other = store_.begin_run(store_.enrol(a_protocol(), "P2"), a_run());
  store_.begin_attempt(other, a_record(1), 1);
  store_.finish_attempt(other, a_record(1));
  for (const Times times : {Times::absolute, Times::relative}) {
    settings.times = times;
    settings.codebook = out_folder_ / "codebook.csv";
    export_csv(store_, out_, settings);
    const Rows all = rows();
    ASSERT_EQ(all.size(), 4U);
    std::map<std::string, std::string> driven;
    for (std::size_t i = 1; i < all.size(); ++i) {
      const auto row = by_name(all, i);
      driven[row.at("participant_id") + row.at("renderer")] = row.at("torque_driven");
    }
    EXPECT_EQ(driven, (std::map<std::string, std::string>{
                          {"P1ray", "0"}, {"P1point", ""}, {"P2ray", "1"}}));
    const std::string book = contents_of(settings.codebook);
    EXPECT_NE(book.find("trials,torque_driven,,0,\"the device drives force alone"),
              std::string::npos);
  }
}

TEST_F(ExportCsv, RowsMissColumnsOfOtherProtocols) {
  show(a_record(3));
  const std::string text = R"({"version": 2, "blocks": [{"name": "soft", "task": "detect"}]})";
  const Participant other =
      store_.enrol({.name = "felt", .text = text, .sha256 = checksum_hex(text)}, "P2");
  const palpate::data::Run run = store_.begin_run(other, a_run());
  TrialRecord record = a_record(1);
  record.task.task = "detect";
  record.task.block_name = "soft";
  store_.begin_attempt(run, record, 1);
  store_.finish_attempt(run, record);
  export_csv(store_, out_, false);
  const Rows all = rows();
  ASSERT_EQ(all.size(), 3U);
  for (std::size_t i = 1; i < all.size(); ++i) {
    const auto row = by_name(all, i);
    const bool has_task = row.at("participant_id") == "P2";
    EXPECT_EQ(row.at("task"), has_task ? "detect" : "");
    EXPECT_EQ(row.at("track"), has_task ? "1" : "");
    EXPECT_EQ(row.at("catch_trial"), has_task ? "0" : "");
  }
}

TEST_F(ExportCsv, EveryFieldStandsInItsColumn) {
  TrialRecord record = a_record(3);
  record.block = 2;
  record.response = "cube";
  record.correct = record.practice = true;
  record.response_time = 0.1 + 0.2;
  record.first_contact_time = 1e-7;
  record.orientation_wxyz = {0.5, -0.25, 1.0 / 3.0, 0};
  record.onset_ns = a_run().clock.monotonic_ns + 1'000'000'000;
  record.ticks = 1234;
  record.missed_ticks = 5;
  record.faults = 6;
  record.started_inside = true;
  record.max_force = 7.5;
  record.contact_share = 0.625;
  record.edge_dwell = 0.1;
  show(record);
  TrialRecord silent = a_record(4);
  silent.timed_out = true;
  silent.response = "";
  silent.response_time = 60;
  silent.first_contact_time.reset();
  show(silent);
  TrialRecord guessed = a_record(5);
  guessed.first_contact_time.reset();
  show(guessed);
  EXPECT_EQ(export_csv(store_, out_, false).trials, 3);
  const auto row = by_name(rows(), 1);
  const std::map<std::string, std::string> expected{{"participant_id", "P1"},
                                                    {"session", "1"},
                                                    {"block", "2"},
                                                    {"trial", "3"},
                                                    {"renderer", "ray"},
                                                    {"shape", "cube"},
                                                    {"response", "cube"},
                                                    {"correct", "1"},
                                                    {"response_time", "0.30000000000000004"},
                                                    {"orientation_w", "0.5"},
                                                    {"orientation_x", "-0.25"},
                                                    {"orientation_y", "0.3333333333333333"},
                                                    {"orientation_z", "0"},
                                                    {"practice", "1"},
                                                    {"timed_out", "0"},
                                                    {"first_contact_time", "1e-07"},
                                                    {"onset_utc", "2023-11-14T22:13:21.123456Z"},
                                                    {"device", "falcon"},
                                                    {"simulated", "0"},
                                                    {"missed_ticks", "5"},
                                                    {"attempt", "1"},
                                                    {"protocol_sha256", a_protocol().sha256},
                                                    {"program_version", "0.1.0"},
                                                    {"participant_number", "4"},
                                                    {"started_inside", "1"},
                                                    {"ticks", "1234"},
                                                    {"longest_period", "0.001003"},
                                                    {"faults", "6"},
                                                    {"max_force", "7.5"},
                                                    {"observer_sha256", ""},
                                                    {"before_contact", "0"},
                                                    {"response_device", ""},
                                                    {"contact_share", "0.625"},
                                                    {"edge_dwell", "0.1"}};
  EXPECT_EQ(row, expected);
  const auto second = by_name(rows(), 2);
  EXPECT_EQ(second.at("timed_out"), "1");
  EXPECT_EQ(second.at("response"), "");
  EXPECT_EQ(second.at("correct"), "0");
  EXPECT_EQ(second.at("response_time"), "60");
  EXPECT_EQ(second.at("first_contact_time"), "");
  EXPECT_EQ(second.at("contact_share"), "") << "not measured";
  EXPECT_EQ(second.at("edge_dwell"), "");
  EXPECT_EQ(second.at("before_contact"), "0") << "there was no answer";
  EXPECT_EQ(by_name(rows(), 3).at("before_contact"), "1");
}

TEST_F(ExportCsv, NumbersReadBackExactly) {
  const double values[] = {
      0.1, 1.0 / 3.0, 59.999999999999993, 5e-324, 1.7976931348623157e308, 123456789.123456789};
  int trial = 0;
  for (const double value : values) {
    TrialRecord record = a_record(++trial);
    record.response_time = value;
    show(record);
  }
  export_csv(store_, out_, false);
  const Rows all = rows();
  for (std::size_t i = 0; i < std::size(values); ++i) {
    const std::string text = by_name(all, i + 1).at("response_time");
    double back = 0;
    std::from_chars(text.data(), text.data() + text.size(), back);
    EXPECT_EQ(back, values[i]) << text;
  }
}

TEST_F(ExportCsv, HostileTextsAreQuotedAndOnlyThose) {
  const std::vector<std::string> texts{"a,b",
                                       "say \"cube\"",
                                       "\"",
                                       "two\r\nlines",
                                       "lf\nonly",
                                       "=1+1",
                                       "+cmd|' /C calc'!A0",
                                       "Würfel",
                                       " padded ",
                                       "'); DROP TABLE attempts;--",
                                       "a;b\tc",
                                       "-5",
                                       "@x",
                                       "\tx",
                                       "\rx",
                                       "\nx",
                                       "'=1",
                                       "''+1",
                                       "'quoted'",
                                       "-"};
  int trial = 0;
  for (const auto& text : texts) {
    TrialRecord record = a_record(++trial);
    record.shape = record.response = text;
    show(record);
  }
  export_csv(store_, out_, false);
  const Rows all = rows();
  ASSERT_EQ(all.size(), texts.size() + 1);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string shape = by_name(all, i + 1).at("shape");
    EXPECT_EQ(unguarded(shape), texts[i]);
    EXPECT_EQ(by_name(all, i + 1).at("response"), shape);
    EXPECT_EQ(std::string("=+-@\t\r\n").find(shape[0]), std::string::npos) << shape;
  }
  const std::string raw = contents_of(out_);
  EXPECT_TRUE(contains(raw, ",\"say \"\"cube\"\"\","));
  EXPECT_TRUE(contains(raw, ",'=1+1,"));
  EXPECT_TRUE(contains(raw, ",''=1,")) << "not to be taken for =1";
  EXPECT_TRUE(contains(raw, ",'quoted',"));
  EXPECT_TRUE(contains(raw, ",0.5,-0.5,0.1,")) << "negative numbers stay numbers";
  EXPECT_TRUE(contains(raw, ", padded ,"));
}

TEST_F(ExportCsv, RelativeTimesKeepIntervalsButNoDates) {
  store_.begin_attempt(run_, a_plan(1), a_run().clock.monotonic_ns);
  store_.cut_off_attempt(run_, "device fault");
  for (const int trial : {1, 2}) {
    TrialRecord record = a_record(trial);
    record.attempt = store_.begin_attempt(run_, record, record.onset_ns);
    store_.finish_attempt(run_, record);
  }
  export_csv(store_, out_, ExportSettings{.times = Times::relative});
  const Rows all = rows();
  EXPECT_EQ(by_name(all, 1).at("onset_utc"), "1900-01-01T00:00:00.000000Z");
  EXPECT_EQ(by_name(all, 1).at("elapsed"), "0");
  EXPECT_EQ(by_name(all, 2).at("onset_utc"), "1900-01-01T00:00:20.000000Z");
  EXPECT_EQ(by_name(all, 2).at("elapsed"), "20");
  EXPECT_EQ(all[0].back(), "elapsed") << "the other columns as ever";
  const auto cut_off = by_name(parse_rfc4180(contents_of(out_folder_ / "attempts.csv")), 1);
  EXPECT_EQ(cut_off.at("began_utc"), "1899-12-31T23:59:39.000000Z");
  EXPECT_EQ(cut_off.at("elapsed"), "-21");
}

TEST_F(ExportCsv, CutOffAttemptsHaveTheirOwnFile) {
  store_.begin_attempt(run_, a_plan(1), a_run().clock.monotonic_ns);
  store_.cut_off_attempt(run_, "device fault, reconnected");
  TrialRecord record = a_record(1);
  record.attempt = store_.begin_attempt(run_, record, 2);
  store_.finish_attempt(run_, record);
  const ExportResult done = export_csv(store_, out_, false);
  EXPECT_EQ(done.trials, 1);
  EXPECT_EQ(done.attempts, 1);
  EXPECT_EQ(done.attempts_path, out_folder_ / "attempts.csv");
  EXPECT_EQ(by_name(rows(), 1).at("attempt"), "2");
  const auto row = by_name(parse_rfc4180(contents_of(done.attempts_path)), 1);
  const std::map<std::string, std::string> expected{{"participant_id", "P1"},
                                                    {"session", "1"},
                                                    {"block", "1"},
                                                    {"trial", "1"},
                                                    {"attempt", "1"},
                                                    {"renderer", "ray"},
                                                    {"shape", "cube"},
                                                    {"orientation_w", "0.5"},
                                                    {"orientation_x", "-0.5"},
                                                    {"orientation_y", "0.1"},
                                                    {"orientation_z", "0.3333333333333333"},
                                                    {"practice", "0"},
                                                    {"began_utc", "2023-11-14T22:13:20.123456Z"},
                                                    {"reason", "device fault, reconnected"},
                                                    {"device", "falcon"},
                                                    {"simulated", "0"},
                                                    {"protocol_sha256", a_protocol().sha256},
                                                    {"program_version", "0.1.0"},
                                                    {"participant_number", "4"}};
  EXPECT_EQ(row, expected);
}

TEST_F(ExportCsv, NothingIsOverwrittenWithoutForce) {
  show(a_record(1));
  export_csv(store_, out_, false);
  EXPECT_EQ(files(), 1) << "no attempts, no file for them, no temporary file";
  write_file(out_, "mine");
  EXPECT_TRUE(contains(error_of([&] { export_csv(store_, out_, false); }), "--force"));
  EXPECT_EQ(contents_of(out_), "mine");
  export_csv(store_, out_, true);
  EXPECT_EQ(rows().size(), 2u);

  fs::remove(out_);
  store_.begin_attempt(run_, a_plan(2), 1);
  store_.cut_off_attempt(run_, "x");
  write_file(out_folder_ / "attempts.csv", "mine");
  EXPECT_THROW(export_csv(store_, out_, false), StoreRefused);
  EXPECT_EQ(contents_of(out_folder_ / "attempts.csv"), "mine");
  EXPECT_FALSE(fs::exists(out_)) << "half an export";
  export_csv(store_, out_, true);
  EXPECT_EQ(parse_rfc4180(contents_of(out_folder_ / "attempts.csv")).size(), 2u);
  EXPECT_EQ(files(), 2);
}

TEST_F(ExportCsv, FilesBesideItTakeItsName) {
  show(a_record(1));
  store_.begin_attempt(run_, a_plan(2), 1);
  store_.cut_off_attempt(run_, "x");
  const ExportSettings settings{.pages = true};
  for (const auto& [out, attempts, pages] : std::vector<std::array<std::string, 3>>{
           {"trials.csv", "attempts.csv", "pages.csv"},
           {"one.csv", "one_attempts.csv", "one_pages.csv"},
           {"two.trials.csv", "two.trials_attempts.csv", "two.trials_pages.csv"},
           {"three", "three_attempts.csv", "three_pages.csv"}}) {
    const ExportResult done = export_csv(store_, out_folder_ / out, settings);
    EXPECT_EQ(done.attempts_path, out_folder_ / attempts);
    EXPECT_EQ(done.pages_path, out_folder_ / pages);
  }
  EXPECT_EQ(files(), 12) << "each study keeps its own";
}

TEST_F(ExportCsv, InvalidPathsAreRefused) {
  EXPECT_THROW(export_csv(store_, out_folder_.path(), true), StoreRefused);
  EXPECT_THROW(export_csv(store_, out_folder_ / "", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, "", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, "/dev/null", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, out_folder_ / "attempts.csv", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, out_folder_ / "pages.csv", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, "-", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, folder_ / "study.db", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, folder_ / "study.db-wal", true), StoreRefused);
  EXPECT_THROW(export_csv(store_, out_folder_ / "none/trials.csv", false), StoreError);
  EXPECT_EQ(files(), 0);
}

TEST_F(ExportCsv, OnlyTheOwnerMayReadIt) {
  export_csv(store_, out_, false);
  struct stat found {};
  ASSERT_EQ(::stat(out_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600u);
}

TEST_F(ExportCsv, DuringASessionOnlyCommittedTrialsAreSeen) {
  show(a_record(1));
  store_.begin_attempt(run_, a_plan(2), 1);
  Store reader = Store::open(store_.path(), Store::Mode::read_only);
  EXPECT_EQ(export_csv(reader, out_, false).trials, 1);
  EXPECT_EQ(files(), 1) << "an open attempt is not cut off";
}

}  // namespace
}  // namespace palpate::data
