#include "data/store/frames.h"

#include <SQLiteCpp/Statement.h>

#include "data/base/checksum.h"
#include "data/store/late_table.h"

namespace palpate::data {
namespace {

constexpr LateTable kFrames{
    "frames",
    "CREATE TABLE frames (attempt_id INTEGER NOT NULL REFERENCES attempts (id), frame INTEGER NOT "
    "NULL CHECK (frame >= 1), swap_ns INTEGER NOT NULL, pose_ns INTEGER NOT NULL, delay_ns INTEGER "
    "NOT NULL CHECK (delay_ns >= 0), PRIMARY KEY (attempt_id, frame)) STRICT, WITHOUT ROWID"};

}  // namespace

bool has_frames(SQLite::Database& db, const std::string& path) { return kFrames.is_in(db, path); }

void write_frames(SQLite::Database& db, std::int64_t attempt,
                  const std::vector<FrameRecord>& frames) {
  if (frames.empty()) return;
  if (!has_frames(db, db.getFilename())) db.exec(kFrames.sql);
  SQLite::Statement insert(db, "INSERT INTO frames VALUES (?, ?, ?, ?, ?)");
  std::int64_t number = 0;
  for (const FrameRecord& frame : frames) {
    insert.reset();
    insert.bind(1, attempt);
    insert.bind(2, ++number);
    insert.bind(3, frame.swap_ns);
    insert.bind(4, frame.pose_ns);
    insert.bind(5, frame.delay_ns);
    insert.exec();
  }
}

std::vector<FrameRecord> read_frames(SQLite::Database& db, std::int64_t attempt) {
  std::vector<FrameRecord> out;
  if (!has_frames(db, db.getFilename())) return out;
  SQLite::Statement find(
      db, "SELECT swap_ns, pose_ns, delay_ns FROM frames WHERE attempt_id = ? ORDER BY frame");
  find.bind(1, attempt);
  while (find.executeStep())
    out.push_back(
        {find.getColumn(0).getInt64(), find.getColumn(1).getInt64(), find.getColumn(2).getInt64()});
  return out;
}

std::string frames_checksum(const std::vector<FrameRecord>& frames) {
  std::string text;
  for (const FrameRecord& frame : frames)
    text += std::to_string(frame.swap_ns) + " " + std::to_string(frame.pose_ns) + " " +
            std::to_string(frame.delay_ns) + "\n";
  return checksum_hex(text);
}

}  // namespace palpate::data
