#include "data/record.h"

namespace palpate::data {
namespace {

// In the order of the enumerators.
constexpr std::array<const char*, 6> kRunEnds = {"running", "done",      "paused",
                                                 "aborted", "withdrawn", "interrupted"};

}  // namespace

const char* to_string(RunEnd end) { return kRunEnds.at(static_cast<std::size_t>(end)); }

std::optional<RunEnd> parse_run_end(std::string_view text) {
  for (std::size_t i = 0; i < kRunEnds.size(); ++i) {
    if (text == kRunEnds[i]) return static_cast<RunEnd>(i);
  }
  return std::nullopt;
}

std::vector<IntervalRecord> intervals_of(const TrialRecord& record) {
  if (!record.task.intervals.empty()) return record.task.intervals;
  return {
      {record.shape, record.renderer, std::nullopt, false, record.onset_ns, record.response_ns}};
}

std::int64_t first_onset_ns(const TrialRecord& record) {
  for (const IntervalRecord& interval : intervals_of(record)) {
    if (interval.onset_ns != 0) return interval.onset_ns;
  }
  return record.onset_ns;
}

std::optional<BodyRecord> body_of(const TrialRecord& record, const SampleRecord& sample) {
  if (sample.bodies == 0) return std::nullopt;
  return record.bodies.at(static_cast<std::size_t>(&sample - record.samples.data()));
}

bool has_right_answer(const TrialRecord& record) {
  const TaskRecord& task = record.task;
  if (task.task == "rate" || task.task == "adjust") return false;
  const bool which = record.response == "1" || record.response == "2";
  if (task.task != "compare" || !which || task.intervals.size() != 2) return true;
  if (!task.dimensions.empty())
    return !task.intervals[0].level || task.intervals[0].level != task.intervals[1].level;
  return !(task.level && task.level == task.standard_level);
}

bool is_participant_code(std::string_view code) {
  if (code.empty() || code.size() > 32) return false;
  for (const char c : code) {
    // Not std::isalnum, which depends on the locale.
    if (!((c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'))) return false;
  }
  return true;
}

}  // namespace palpate::data
