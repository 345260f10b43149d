// Answers to pages: personal data, in a separate table.

#include <SQLiteCpp/Statement.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

#include "data/files/utc.h"
#include "data/store/connection.h"
#include "data/store/forget.h"
#include "data/store/protocol_rows.h"
#include "data/store/record_columns.h"
#include "data/store/statement.h"
#include "data/store/store_error.h"

namespace palpate::data {
namespace {

constexpr int kPagesSince = 5;  // schema version

/// \param answers  in the order in which they were given
void mark_replaced(std::vector<StoredPageAnswer>& answers) {
  std::set<std::tuple<std::int64_t, int, std::string, std::string>> later;
  for (auto one = answers.rbegin(); one != answers.rend(); ++one)
    one->replaced =
        !later.insert({one->participant.id, one->session, one->answer.page, one->answer.item})
             .second;
}

[[noreturn]] void refuse_enrolment(const std::string& path, const std::string& why) {
  throw StoreRefused(path + ": " + why);
}

void require_enrollable(const std::string& path, const ProtocolInfo& protocol,
                        const std::string& code, std::optional<int> wanted_number, bool simulated,
                        std::optional<std::uint64_t> seed) {
  Validator validator;
  validator.expect(
      is_participant_code(code),
      "the participant's code must be 1 to 32 letters (A-Z, a-z) and digits, a pseudonym");
  if (wanted_number) validator.positive("the participant's number", *wanted_number);
  validator.expect(simulated || !seed, "only a simulated participant has a seed");
  validate(validator, protocol);
  validator.throw_if_invalid(path + ": participant");
}

/// The participant with this code in the protocol. \throws StoreRefused: with another number, seed,
/// or simulated instead of real.
std::optional<Participant> find_enrolled(SQLite::Database& db, const std::string& path,
                                         std::int64_t protocol, const Participant& wanted,
                                         std::optional<int> number) {
  SQLite::Statement find(
      db,
      "SELECT id, number, coalesce((SELECT enrolled_number FROM renumberings WHERE "
      "participant_id = id), number), simulated, seed FROM participants WHERE protocol_id = ? "
      "AND code = ?");
  Binder(find) << protocol << wanted.code;
  if (!find.executeStep()) return std::nullopt;
  Participant person = wanted;
  bool was_simulated = false;
  std::optional<std::string> was_seed;
  RowReader(find) >> person.id >> person.number >> person.enrolled_number >> was_simulated >>
      was_seed;
  if (number && *number != person.number && *number != person.enrolled_number) {
    refuse_enrolment(path, "participant " + person.code + " has number " +
                               std::to_string(person.number) + ", not " + std::to_string(*number) +
                               "; leave the number out to continue");
  }
  if (was_simulated != person.simulated) {
    refuse_enrolment(path, "participant " + person.code + " is " +
                               (was_simulated ? "simulated" : "real") +
                               " in this database; use another code or another database");
  }
  const auto text = person.seed ? std::optional(std::to_string(*person.seed)) : std::nullopt;
  if (was_seed != text) {
    refuse_enrolment(path, "participant " + person.code + " was simulated with seed " +
                               was_seed.value_or("(none)") + ", not " + text.value_or("(none)") +
                               "; use that seed or another database");
  }
  return person;
}

/// The wanted number, or the smallest unused one: gaps would unbalance the counterbalancing.
int free_number(SQLite::Database& db, const std::string& path, std::optional<std::int64_t> protocol,
                std::optional<int> wanted) {
  SQLite::Statement numbers(
      db, "SELECT number, code FROM participants WHERE protocol_id = ? ORDER BY number");
  Binder(numbers) << protocol;
  int next = 1;
  while (numbers.executeStep()) {
    const int number = numbers.getColumn(0).getInt();
    if (wanted == number) {
      refuse_enrolment(path, "number " + std::to_string(number) + " is taken by participant " +
                                 numbers.getColumn(1).getString() +
                                 "; leave the number out for the next unused one");
    }
    if (number == next) ++next;
  }
  return wanted.value_or(next);
}

}  // namespace

void Store::add_page_answers(const Run& run, const std::vector<PageAnswer>& answers) {
  Validator validator;
  for (const PageAnswer& answer : answers) validate(validator, answer);
  validator.throw_if_invalid(impl_->path + ": answers to a page");
  impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    impl_->require_running(run);
    for (const PageAnswer& answer : answers) {
      SQLite::Statement add(db,
                            "INSERT INTO page_answers (run_id, page, item, version, text_sha256, "
                            "answer, at_ns) VALUES (?, ?, ?, ?, ?, ?, ?)");
      Binder(add) << run.id << answer.page << answer.item << answer.version << answer.text_sha256
                  << answer.answer << answer.at_ns;
      add.exec();
      impl_->seals->page_answer(db.getLastInsertRowid());
    }
    return true;
  });
}

std::vector<StoredPageAnswer> Store::page_answers() {
  return guarded(impl_->path, [&] {
    std::vector<StoredPageAnswer> all;
    if (impl_->version < kPagesSince) return all;
    SQLite::Statement find(*impl_->db,
                           "SELECT " + person_columns(impl_->version) +
                               ", pr.name, s.number, r.started_utc_ns, r.started_ns, " +
                               kPageAnswerColumns + kFromProtocolDown +
                               "JOIN runs r ON r.session_id = s.id JOIN page_answers p ON p.run_id "
                               "= r.id ORDER BY pr.id, pa.number, s.number, r.id, p.id");
    while (find.executeStep()) {
      StoredPageAnswer& one = all.emplace_back();
      ClockStamp clock;
      RowReader row(find);
      row >> one.participant;
      row >> one.protocol_name >> one.session >> clock.utc_ns >> clock.monotonic_ns;
      row >> one.answer;
      one.unix_ns = to_unix_ns(clock, one.answer.at_ns);
      one.utc = format_utc(one.unix_ns);
    }
    mark_replaced(all);
    return all;
  });
}

std::vector<PageAnswer> Store::answers_in_force(const Participant& participant, int session) {
  return guarded(impl_->path, [&] {
    std::vector<PageAnswer> answers;
    if (impl_->version < kPagesSince) return answers;
    SQLite::Statement find(
        *impl_->db, std::string("SELECT ") + kPageAnswerColumns +
                        " FROM page_answers p JOIN runs r ON r.id = p.run_id JOIN sessions s "
                        "ON s.id = r.session_id WHERE s.participant_id = ? AND s.number = ? "
                        "ORDER BY r.id, p.id");
    Binder(find) << participant.id << session;
    while (find.executeStep()) {
      PageAnswer answer;
      RowReader row(find);
      row >> answer;
      const auto before = std::find_if(answers.begin(), answers.end(), [&](const PageAnswer& one) {
        return one.page == answer.page && one.item == answer.item;
      });
      if (before == answers.end()) {
        answers.push_back(std::move(answer));
      } else {
        *before = std::move(answer);
      }
    }
    return answers;
  });
}

// Enrolment in a protocol, codes and numbers.

Participant Store::look_up(const ProtocolInfo& protocol, const std::string& code,
                           std::optional<int> wanted_number, bool simulated,
                           std::optional<std::uint64_t> seed) {
  require_enrollable(impl_->path, protocol, code, wanted_number, simulated, seed);
  return guarded(impl_->path, [&] {
    SQLite::Database& db = *impl_->db;
    Participant person{.code = code, .simulated = simulated, .seed = seed};
    const auto protocol_id = find_protocol(db, impl_->path, protocol);
    if (protocol_id) {
      if (const auto known = find_enrolled(db, impl_->path, *protocol_id, person, wanted_number)) {
        return *known;
      }
    }
    if (Tombstones::read(db, impl_->path).holds(code)) {
      impl_->refuse("the participant with code " + code +
                    " has withdrawn; the code cannot be used again, choose another");
    }
    person.number = person.enrolled_number =
        free_number(db, impl_->path, protocol_id, wanted_number);
    return person;
  });
}

Participant Store::enrol(const ProtocolInfo& protocol, const std::string& code,
                         std::optional<int> wanted_number, bool simulated,
                         std::optional<std::uint64_t> seed) {
  return impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    Participant person = look_up(protocol, code, wanted_number, simulated, seed);
    const std::int64_t protocol_id = insert_protocol_if_absent(db, impl_->path, protocol);
    if (person.id != 0) return person;
    SQLite::Statement add(db,
                          "INSERT INTO participants (protocol_id, code, number, simulated, seed) "
                          "VALUES (?, ?, ?, ?, ?)");
    Binder(add) << protocol_id << code << person.number << simulated
                << (seed ? std::optional(std::to_string(*seed)) : std::nullopt);
    add.exec();
    person.id = db.getLastInsertRowid();
    return person;
  });
}

std::vector<std::string> Store::codes() {
  return guarded(impl_->path, [&] {
    std::vector<std::string> all;
    SQLite::Statement find(*impl_->db,
                           "SELECT code FROM participants GROUP BY code ORDER BY min(id)");
    while (find.executeStep()) all.push_back(find.getColumn(0).getString());
    return all;
  });
}

}  // namespace palpate::data
