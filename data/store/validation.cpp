#include "data/store/validation.h"

#include <cmath>
#include <cstdint>
#include <limits>

#include "data/errors.h"
#include "data/files/checksum.h"

namespace palpate::data {

// Well-formed byte sequences: The Unicode Standard, table 3-7.
bool is_clean_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i++]);
    if (lead == 0) return false;
    if (lead < 0x80) continue;
    const int more = lead >= 0xC2 && lead <= 0xDF   ? 1
                     : lead >= 0xE0 && lead <= 0xEF ? 2
                     : lead >= 0xF0 && lead <= 0xF4 ? 3
                                                    : 0;
    if (more == 0) return false;
    for (int k = 0; k < more; ++k, ++i) {
      if (i >= text.size()) return false;
      const auto next = static_cast<unsigned char>(text[i]);
      unsigned low = 0x80, high = 0xBF;
      if (k == 0 && lead == 0xE0) low = 0xA0;   // overlong
      if (k == 0 && lead == 0xED) high = 0x9F;  // surrogates
      if (k == 0 && lead == 0xF0) low = 0x90;   // overlong
      if (k == 0 && lead == 0xF4) high = 0x8F;  // past U+10FFFF
      if (next < low || next > high) return false;
    }
  }
  return true;
}

void Validator::expect(bool holds, const std::string& expectation) {
  if (!holds) faults_.push_back(expectation);
}

void Validator::text(const char* field, std::string_view value) {
  expect(is_clean_utf8(value), std::string(field) + " must be UTF-8 text without NUL");
}

void Validator::present(const char* field, std::string_view value) {
  text(field, value);
  expect(!value.empty(), std::string(field) + " must not be empty");
}

void Validator::amount(const char* field, double value) {
  finite(field, value);
  expect(!(value < 0), std::string(field) + " must not be below zero");
}

void Validator::finite(const char* field, double value) {
  expect(std::isfinite(value), std::string(field) + " must be a finite number");
}

void Validator::positive(const char* field, int value) {
  expect(value >= 1, std::string(field) + " must be 1 or more, not " + std::to_string(value));
}

void Validator::throw_if_invalid(const std::string& what) const {
  if (faults_.empty()) return;
  std::string message = what + ": not stored:";
  for (std::size_t i = 0; i < faults_.size(); ++i) message += (i > 0 ? "; " : " ") + faults_[i];
  throw StoreRefused(message);
}

void validate(Validator& validator, const ProtocolInfo& protocol) {
  validator.present("protocol's name", protocol.name);
  validator.present("protocol's text", protocol.text);
  validator.expect(protocol.sha256 == checksum_hex(protocol.text),
                   "protocol's SHA-256 must be that of its text");
  for (const ProtocolFile& file : protocol.files) validator.present("name of a file", file.name);
}

void validate(Validator& validator, const RunInfo& info, bool simulated) {
  validator.positive("session", info.session);
  validator.present("program version", info.program_version);
  validator.present("device", info.device);
  validator.text("build", info.build);
  validator.text("device calibration", info.device_calibration);
  validator.text("response device", info.response_device);
  validator.text("consent version", info.consent_version);
  validator.text("hand", info.hand);
  validator.text("observer's checksum", info.observer_sha256);
  validator.expect(simulated || info.observer_sha256.empty(),
                   "only a simulated participant has observer settings");
  if (info.response_latency) validator.finite("response latency", *info.response_latency);
}

void validate_plan(Validator& validator, const TrialRecord& record, int session) {
  validator.expect(record.session == session,
                   "session must be the run's, " + std::to_string(session));
  validator.positive("block", record.block);
  validator.positive("trial", record.trial);
  validator.present("renderer", record.renderer);
  validator.present("shape", record.shape);
  for (const double q : record.orientation_wxyz) validator.finite("orientation", q);
}

void validate(Validator& validator, const PageAnswer& answer) {
  validator.present("page", answer.page);
  validator.present("item", answer.item);
  validator.text("version", answer.version);
  validator.text("answer", answer.answer);
  validator.expect(answer.text_sha256.size() == 64, "text_sha256 must be a SHA-256");
}

namespace {

void validate_task(Validator& validator, const TaskRecord& task) {
  validator.present("task", task.task);
  validator.present("block_name", task.block_name);
  validator.positive("track", task.track);
  for (const auto& value : {task.level, task.standard_level, task.number, task.confidence}) {
    if (value) validator.finite("a number of the task", *value);
  }
  for (const IntervalRecord& interval : task.intervals) {
    validator.text("stimulus", interval.stimulus);
    if (interval.level) validator.finite("level", *interval.level);
  }
}

}  // namespace

void validate_outcome(Validator& validator, const TrialRecord& record) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  validator.text("response", record.response);
  validator.amount("response_time", record.response_time);
  if (record.first_contact_time) validator.amount("first_contact_time", *record.first_contact_time);
  for (int i = 0; i < 3; ++i) {
    validator.finite("start_tip", record.start_tip[i]);
    validator.finite("start_tail", record.start_tail[i]);
  }
  validator.amount("max_force", record.max_force);
  if (record.contact_share) {
    validator.amount("contact_share", *record.contact_share);
    validator.expect(!(*record.contact_share > 1), "contact_share must be at most 1");
  }
  if (record.task) validate_task(validator, *record.task);
  if (record.edge_dwell) validator.amount("edge_dwell", *record.edge_dwell);
  validator.expect(record.ticks <= kMost && record.missed_ticks <= kMost, "ticks must fit 63 bits");
  validator.expect(!record.timed_out || (record.response.empty() && !record.correct),
                   "a time-out has no response and is not correct");
}

}  // namespace palpate::data
