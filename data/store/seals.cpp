#include "data/store/seals.h"

#include <nettle/sha2.h>

#include <array>

#include "data/errors.h"
#include "data/store/record_columns.h"
#include "data/store/task_text.h"

namespace palpate::data {
namespace {

Checksum finish_sum(sha256_ctx& context) {
  Checksum sum;
  sha256_digest(&context, sum.size(), sum.data());
  return sum;
}

}  // namespace

Checksum SealedValues::seal(const Checksum& previous) const {
  sha256_ctx context;
  sha256_init(&context);
  sha256_update(&context, previous.size(), previous.data());
  sha256_update(&context, size_, bytes_.data());
  return finish_sum(context);
}

Checksum checksum_of_samples(int packing, std::int64_t count, const void* data, std::size_t size) {
  std::array<unsigned char, 12> head{};
  for (std::size_t i = 0; i < 4; ++i) head[i] = static_cast<unsigned char>(packing >> 8 * i);
  for (std::size_t i = 0; i < 8; ++i) head[4 + i] = static_cast<unsigned char>(count >> 8 * i);
  sha256_ctx context;
  sha256_init(&context);
  sha256_update(&context, head.size(), head.data());
  sha256_update(&context, size, static_cast<const unsigned char*>(data));
  return finish_sum(context);
}

void put_session(SealedValues& out, const SessionHead& session) {
  const Participant& person = session.participant;
  out.begin("session") << session.protocol_sha256 << session.protocol_name << person.code
                       << person.enrolled_number << person.simulated
                       << (person.seed ? std::optional(std::to_string(*person.seed)) : std::nullopt)
                       << session.number << session.observer_sha256;
}

void put_run(SealedValues& out, const RunInfo& info) {
  out.begin("run") << info.clock.utc_ns << info.clock.monotonic_ns << info.program_version
                   << info.build << info.device << info.device_calibration << info.response_device
                   << info.response_latency << info.consent_version << info.consent_utc_ns
                   << info.hand
                   << (info.protocol_sha256.empty() ? std::nullopt
                                                    : std::optional(info.protocol_sha256))
                   << info.files_sha256;
}

void put_note(SealedValues& out, std::int64_t run_link, std::int64_t at_ns,
              const std::string& text) {
  out.begin("note") << run_link << at_ns << text;
}

void put_attempt(SealedValues& out, const AttemptSealed& attempt, const TrialRecord& record) {
  out.begin("attempt") << attempt.run_link << record.trial << record.attempt << record.block
                       << record.renderer << record.shape << record.practice;
  for (const double q : record.orientation_wxyz) out << q;
  out << attempt.began_ns;
  if (attempt.cut_off_reason) {
    out << std::string("cut_off") << *attempt.cut_off_reason;
    constexpr int kOutcomes = 19;  // columns from response to max_force
    for (int i = 0; i < kOutcomes; ++i) out << std::optional<int>();
  } else {
    out << std::string("completed") << std::optional<int>() << record.response << record.correct
        << record.timed_out << record.response_time << record.first_contact_time << record.onset_ns
        << record.response_ns;
    for (const double x : record.start_tip) out << x;
    for (const double x : record.start_tail) out << x;
    out << record.ticks << record.missed_ticks << record.longest_period_ns << record.faults
        << record.started_inside << record.max_force;
  }
  out << attempt.samples;
  if (record.contact_share || record.edge_dwell) out << record.contact_share << record.edge_dwell;
  if (record.task) out << task_text(*record.task);
}

void put_page_answer(SealedValues& out, std::int64_t run_link, const PageAnswer& answer) {
  out.begin("page") << run_link << answer.page << answer.item << answer.version
                    << answer.text_sha256 << answer.answer << answer.at_ns;
}

void put_end(SealedValues& out, std::int64_t run_link, const std::string& reason,
             std::optional<std::int64_t> ended_ns) {
  out.begin("end") << run_link << reason << ended_ns;
}

void ChainCheck::fail(const RowName& name, const char* what) const {
  std::string text = session_ + ", " + name.kind;
  if (name.number > 0) text += " " + std::to_string(name.number);
  if (name.attempt > 0) text += ", attempt " + std::to_string(name.attempt);
  throw StoreRefused(text + what +
                     "; restore a backup (correct data in the analysis or in a copy of an export, "
                     "not in the database)");
}

void ChainCheck::take(const Checksum& seal, const SealedValues& values, const RowName& name) {
  if (values.seal(last_) != seal) {
    fail(name, links_ > 0 ? ": was changed since it was recorded: it does not match its seal"
                          : ", or the participant, protocol or settings that it belongs to, was "
                            "changed since it was recorded: it does not match its seal");
  }
  last_ = seal;
  ++links_;
}

void ChainCheck::add(const std::optional<Link>& link, const SealedValues& values,
                     const RowName& name) {
  if (!link) fail(name, ": has no seal: palpate did not record it");
  if (link->position != links_ + 1) {
    const bool added =
        link->position > links_ &&
        waiting_.try_emplace(link->position, Waiting{link->seal, values, name}).second;
    if (!added) fail(name, ": is at the position of another sealed row");
    return;
  }
  take(link->seal, values, name);
  for (auto next = waiting_.begin(); next != waiting_.end() && next->first == links_ + 1;
       next = waiting_.erase(next)) {
    take(next->second.seal, next->second.values, next->second.name);
  }
}

void ChainCheck::finish() const {
  if (waiting_.empty()) return;
  fail(waiting_.begin()->second.name, ": rows before it are missing");
}

}  // namespace palpate::data
