#pragma once
// Internal to data/export: rows of CSV and TSV files, and tables made of them.

#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "data/base/cell_name.h"
#include "data/column_table.h"
#include "data/export/clock.h"
#include "data/export/settings.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"
#include "data/store/store.h"
#include "data/trial_columns.h"

namespace palpate::data {

// Internal to data/export: name, unit and meaning of every exported column. One table for CSV
// headers, the codebook, BIDS sidecars and variableMeasured of Psych-DS.

struct Column {
  /// Unit of the block's varied number, which its protocol names.
  static constexpr const char* kLevelUnit = "see block_name";
  const char* name;
  const char* description;
  const char* unit = "";  ///< "1": a pure number; "": a text or a code
  /// Code -> meaning; empty: the values are not codes.
  std::vector<std::pair<const char*, const char*>> levels = {};
  /// Other values: names from the protocol, or answers to its tasks.
  enum class Names { none, stimuli, blocks, answers } names = Names::none;
};

/// Columns of trials.csv, in order, as an export has them. Groups, blocks of tasks, runs with
/// torque left out and relative times add some.
std::span<const Column> trial_columns(const ExportClock& clock);
/// Those that do not only describe the participant.
std::span<const Column> columns_of_trial(const ExportClock& clock);
std::span<const Column> attempt_columns(const ExportClock& clock);  ///< of attempts.csv, likewise
/// The group of a participant.
const Column& group_column();
std::span<const Column> sample_columns();  ///< of a servo tick, in order
/// After them, if a stimulus of the protocol moves: its state after the tick.
std::span<const Column> body_columns();
/// After those, if contacts are requested.
std::span<const Column> contact_columns();
/// Before them: the interval of a trial, if its protocols have blocks; else none.
std::span<const Column> interval_columns(const ProtocolFacts& facts);

enum class DelimitedFormat {
  csv,  ///< RFC 4180: fields quoted where needed, CRLF; a missing value is an empty field
  tsv,  ///< BIDS: tab, LF; a missing value is n/a. No quoting: some texts are refused
};

/// Appends values left to right. Numbers are written as the shortest text that reads back as the
/// same number (std::to_chars), with a decimal point in every locale; booleans as 0 or 1.
class DelimitedRow {
 public:
  explicit DelimitedRow(DelimitedFormat style) : style_(style) {}

  /// "" is a missing value; texts that a spreadsheet would evaluate are guarded (text_sink.h).
  /// \throws StoreRefused: a text that TSV cannot represent (tabs, line breaks, the text "n/a").
  DelimitedRow& operator<<(std::string_view text);
  DelimitedRow& operator<<(const char* text) { return *this << std::string_view(text); }
  DelimitedRow& operator<<(bool value) { return raw(value ? "1" : "0"); }
  template <class Number>
  requires std::is_arithmetic_v<Number> DelimitedRow& operator<<(Number value) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
    return raw({text.data(), static_cast<std::size_t>(end.ptr - text.data())});
  }
  /// With at most `decimals` decimals, without trailing zeros.
  DelimitedRow& rounded(double value, int decimals);
  template <class T>
  DelimitedRow& operator<<(const std::optional<T>& value) {
    return value ? *this << *value : *this << std::string_view();
  }
  DelimitedRow& operator<<(std::span<const Column> names);

  /// The row with its line end; valid until the next value is appended.
  const std::string& end();

 private:
  DelimitedRow& raw(std::string_view text);
  DelimitedRow& cell(std::string_view text);
  DelimitedFormat style_;
  std::string row_;
  bool ended_ = true;
};

// Internal to data/export: the values of the columns that delimited_row.h defines, in the same
// order.

/// Missing where no answer is right or wrong.
inline std::optional<bool> correct_of(const TrialRecord& record) {
  if (!has_right_answer(record)) return std::nullopt;
  return record.correct;
}

/// The levels of the factors, in the order of clock.factors().
template <class Row>
void put_factors(Row& row, const TrialRecord& record, const ExportClock& clock) {
  if (clock.factors().empty()) return;
  const CellName name = cell_name(record.shape);
  for (const StoredFactor& factor : clock.factors()) row << name.level(factor.name);
}

/// The columns of every trial, after the participant. \param row  a DelimitedRow or a ColumnTable
template <class Row>
void put_plain_columns(Row& row, const StoredTrial& trial, const ExportClock& clock) {
  const TrialRecord& record = trial.record;
  row << record.session << record.block << record.trial << record.renderer
      << base_name(record.shape) << record.response << correct_of(record) << record.response_time;
  for (const double q : record.orientation_wxyz) row << q;
  row << record.practice;
  put_factors(row, record, clock);
  row << record.timed_out << record.first_contact_time << clock.onset_utc(trial) << trial.run.device
      << trial.participant.simulated << record.missed_ticks << record.attempt
      << trial.protocol_sha256 << trial.run.program_version << trial.participant.enrolled_number
      << record.started_inside << record.ticks
      << static_cast<double>(record.longest_period_ns) / 1e9 << record.faults << record.max_force
      << trial.run.observer_sha256 << (!record.response.empty() && !record.first_contact_time)
      << trial.run.response_device;
  for_each_measured(record, [&](const MeasuredColumn& column, const auto& value) {
    if (*column.description) row << value;
  });
}
/// columns_of_trial()
void put_columns_of_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock);
/// trial_columns()
void put_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock);
/// attempt_columns()
void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock);
/// sample_columns(): positions rounded to 1 nm, forces to 1 uN and torques to 1 uN m, a thousandth
/// of the resolution of any device; the database has all digits.
void put_sample(DelimitedRow& row, const SampleRecord& sample);
/// contact_columns(), positions rounded to 1 nm; missing in free space.
void put_contact(DelimitedRow& row, const std::optional<TickContact>& contact);
/// \param columns  as interval_columns()
void put_interval(DelimitedRow& row, std::span<const Column> columns, int interval);
/// Whether a stimulus of the protocol moves: samples then have body_columns() as well.
bool has_bodies(const ProtocolFacts& facts);
/// body_columns(), rounded to 1e-9 of their unit; missing if the stimulus is at rest.
/// \param sample  an element of record.samples
void put_body(DelimitedRow& row, const TrialRecord& record, const SampleRecord& sample);

// Internal to data/export: answers to pages as a table. Personal data: written only when asked for.

/// Of pages.csv, in order.
std::span<const Column> page_columns();

/// RFC 4180: a row for each answer, by protocol, participant, session and time. \return  rows
std::int64_t write_pages(Store& store, TextSink& out, const ExportClock& clock,
                         ExportedParticipants& participants);

/// Completed trials in memory, as trials.csv has them.
/// Columns with the names, order and values of an exported trials.csv with absolute times; texts
/// are not guarded against spreadsheets.
class TrialTable {
 public:
  TrialTable();
  void add(const StoredTrial& trial);
  const ColumnTable& table() const { return table_; }

 private:
  ColumnTable table_;
};

}  // namespace palpate::data
