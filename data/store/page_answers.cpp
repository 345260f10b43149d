// Answers to pages: personal data, in a table apart from trials.

#include <SQLiteCpp/Statement.h>

#include "data/files/utc.h"
#include "data/store/connection.h"
#include "data/store/record_columns.h"
#include "data/store/sqlite_errors.h"
#include "data/store/statement_values.h"
#include "data/store/validation.h"

namespace palpate::data {
namespace {

constexpr int kPagesSince = 5;  // schema version

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
    return all;
  });
}

bool Store::has_tasks() {
  return guarded(impl_->path, [&] {
    if (impl_->version < kPagesSince) return false;
    // Of each run one attempt tells it: a run has one protocol.
    SQLite::Statement find(*impl_->db,
                           "SELECT 1 FROM runs r WHERE (SELECT task FROM attempts a WHERE a.run_id "
                           "= r.id LIMIT 1) IS NOT NULL LIMIT 1");
    return find.executeStep();
  });
}

std::vector<std::string> Store::answered_pages(const Participant& participant, int session) {
  return guarded(impl_->path, [&] {
    std::vector<std::string> pages;
    if (impl_->version < kPagesSince) return pages;
    SQLite::Statement find(*impl_->db,
                           "SELECT DISTINCT p.page FROM page_answers p JOIN runs r ON r.id = "
                           "p.run_id JOIN sessions s ON s.id = r.session_id WHERE "
                           "s.participant_id = ? AND s.number = ?");
    Binder(find) << participant.id << session;
    while (find.executeStep()) pages.push_back(find.getColumn(0).getString());
    return pages;
  });
}

}  // namespace palpate::data
