#include "data/export/column_values.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "data/export/column_definitions.h"

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

}  // namespace palpate::data
