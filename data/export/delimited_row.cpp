#include "data/export/delimited_row.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "data/export/column_definitions.h"
#include "data/files/text_sink.h"
#include "data/store/store.h"

namespace palpate::data {
namespace {

void add_to_list(std::string& list, std::optional<double> value, bool first) {
  if (!first) list += ';';
  char text[32];
  if (value) list.append(text, std::to_chars(text, text + sizeof text, *value).ptr);
}

}  // namespace

TaskValues::TaskValues(const TrialRecord& record) {
  if (!record.task) return;
  const TaskRecord& from = *record.task;
  task = from.task;
  block_name = from.block_name;
  track = from.track;
  level = from.level;
  standard_level = from.standard_level;
  catch_trial = from.catch_trial;
  success = from.success;
  number = from.number;
  confidence = from.confidence;
  if (from.confidence_ns)
    confidence_delay = static_cast<double>(*from.confidence_ns - record.response_ns) / 1e9;
  for (std::size_t i = 0; i < from.intervals.size(); ++i) {
    const IntervalRecord& interval = from.intervals[i];
    const std::int64_t zero = from.intervals.front().onset_ns;
    add_to_list(onsets, static_cast<double>(interval.onset_ns - zero) / 1e9, i == 0);
    add_to_list(ends, static_cast<double>(interval.end_ns - zero) / 1e9, i == 0);
    add_to_list(levels, interval.level, i == 0);
    if (from.task == "compare" && !interval.standard) comparison_interval = static_cast<int>(i) + 1;
  }
}

void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock) {
  const TrialRecord& record = attempt.record;
  row << attempt.participant.code << record.session << record.block << record.trial
      << record.attempt << record.renderer << record.shape;
  for (const double q : record.orientation_wxyz) row << q;
  row << record.practice << clock.onset_utc(attempt) << attempt.cut_off_reason << attempt.run.device
      << attempt.participant.simulated << attempt.protocol_sha256 << attempt.run.program_version
      << attempt.participant.enrolled_number;
  if (clock.relative()) row << clock.elapsed(attempt);
}

void put_sample(DelimitedRow& row, const SampleRecord& sample) {
  row << sample.tick;
  constexpr int kNanometre = 9, kMicronewton = 6;  // decimals
  for (const auto& vector : {sample.tip, sample.tail}) {
    for (const double x : vector) row.rounded(x, kNanometre);
  }
  for (const auto& vector : {sample.force, sample.torque, sample.device1, sample.device2}) {
    for (const double x : vector) row.rounded(x, kMicronewton);
  }
  row.rounded(sample.depth, kNanometre);
  row << unsigned{sample.contacts} << unsigned{sample.contact_type} << unsigned{sample.buttons}
      << sample.faults << static_cast<double>(sample.period_ns) / 1e9
      << static_cast<double>(sample.lateness_ns) / 1e9
      << static_cast<double>(sample.compute_ns) / 1e9;
}

void put_contact(DelimitedRow& row, const std::optional<TickContact>& contact) {
  constexpr int kDecimals = 9;
  for (std::size_t k = 0; k < contact_columns().size(); ++k) {
    if (contact)
      row.rounded(k < 3 ? contact->point[k] : contact->normal[k - 3], kDecimals);
    else
      row << "";
  }
}

bool has_bodies(const ProtocolFacts& facts) {
  return std::any_of(facts.stimuli.begin(), facts.stimuli.end(), [](const StimulusFacts& stimulus) {
    return read_json(stimulus.object).contains("body");
  });
}

void put_body(DelimitedRow& row, const TrialRecord& record, const SampleRecord& sample) {
  const std::optional<BodyRecord> body = body_of(record, sample);
  if (!body) {
    for (std::size_t k = 0; k < body_columns().size(); ++k) row << "";
    return;
  }
  constexpr int kDecimals = 9;
  for (const double x : body->centre) row.rounded(x, kDecimals);
  for (const double x : body->orientation_wxyz) row.rounded(x, kDecimals);
  for (const auto& vector : {body->velocity, body->spin}) {
    for (const double x : vector) row.rounded(x, kDecimals);
  }
}

namespace {

bool quotes_needed(std::string_view text) {
  // Without early exit, so that compilers vectorise the loop.
  bool needed = false;
  for (const char c : text) needed |= c == ',' || c == '"' || c == '\r' || c == '\n';
  return needed;
}

bool fits_tsv(std::string_view text) {
  return text != "n/a" && std::none_of(text.begin(), text.end(),
                                       [](char c) { return c == '\t' || c == '\r' || c == '\n'; });
}

}  // namespace

DelimitedRow& DelimitedRow::raw(std::string_view text) {
  if (ended_) {
    row_.clear();
    ended_ = false;
  } else {
    row_ += style_ == DelimitedFormat::csv ? ',' : '\t';
  }
  row_ += text;
  return *this;
}

DelimitedRow& DelimitedRow::operator<<(std::string_view text) {
  return needs_guard(text) ? cell("'" + std::string(text)) : cell(text);
}

DelimitedRow& DelimitedRow::cell(std::string_view text) {
  if (style_ == DelimitedFormat::tsv) {
    if (!fits_tsv(text)) {
      throw StoreRefused("the text '" + std::string(text) +
                         "' cannot be written to a TSV file (tab, line break or the text n/a); "
                         "export as csv or psych-ds");
    }
    return raw(text.empty() ? "n/a" : text);
  }
  if (!quotes_needed(text)) return raw(text);
  raw("\"");
  for (const char c : text) row_.append(c == '"' ? 2 : 1, c);
  row_ += '"';
  return *this;
}

DelimitedRow& DelimitedRow::operator<<(std::span<const Column> names) {
  for (const Column& column : names) raw(column.name);
  return *this;
}

DelimitedRow& DelimitedRow::rounded(double value, int decimals) {
  std::array<char, 400> text{};  // the largest double has 309 digits
  const auto made = std::to_chars(text.data(), text.data() + text.size(), value,
                                  std::chars_format::fixed, decimals);
  std::string_view shown(text.data(), static_cast<std::size_t>(made.ptr - text.data()));
  if (shown.find('.') != std::string_view::npos) {
    shown.remove_suffix(shown.size() - 1 - shown.find_last_not_of('0'));
    if (shown.back() == '.') shown.remove_suffix(1);
  }
  return raw(shown == "-0" ? "0" : shown);
}

const std::string& DelimitedRow::end() {
  row_ += style_ == DelimitedFormat::csv ? "\r\n" : "\n";
  ended_ = true;
  return row_;
}

std::span<const Column> page_columns() {
  static const std::vector<Column> all = {
      {"participant_id", "Pseudonym of the participant"},
      {"protocol", "Name of the protocol"},
      {"session", "Session of the participant, from 1", "1"},
      {"page", "Name of the page"},
      {"item", "Name of the question; 'consent' of a consent"},
      {"answer",
       "As it was typed, or the choice in the protocol's own language; missing where it was left "
       "out. Of a consent: agree"},
      {"consent_version", "Of a consent's text, as the protocol calls it"},
      {"text_sha256", "SHA-256 of the text or question that was shown"},
      {"answered_utc", "When it was answered, ISO 8601, UTC", "ISO 8601"},
      {"simulated",
       "Who answered",
       "",
       {{"0", "a person"}, {"1", "SIMULATED: drawn by chance, or at no real device"}}},
  };
  return all;
}

std::int64_t write_pages(Store& store, TextSink& out, const ExportClock& clock,
                         ExportedParticipants& participants) {
  DelimitedRow row(DelimitedFormat::csv);
  row << page_columns();
  out.write(row.end());
  std::int64_t rows = 0;
  for (const StoredPageAnswer& one : store.page_answers()) {
    const PageAnswer& answer = one.answer;
    row << one.participant.code << one.protocol_name << one.session << answer.page << answer.item
        << answer.answer << answer.version << answer.text_sha256
        << clock.utc(one.participant, one.unix_ns) << one.participant.simulated;
    out.write(row.end());
    participants.add(one.participant);
    ++rows;
  }
  return rows;
}

namespace {

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const Column& column : trial_columns(Times::absolute)) out.emplace_back(column.name);
  return out;
}

}  // namespace

TrialTable::TrialTable() : table_(names()) {}

void TrialTable::add(const StoredTrial& trial) {
  put_trial(table_, trial, ExportClock());
  table_.end_row();
}

}  // namespace palpate::data
