#include "data/export_csv.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTrialColumns =
    "participant_id,session,block,trial,renderer,shape,response,correct,response_time,orientation_"
    "w,"
    "orientation_x,orientation_y,orientation_z,practice,timed_out,first_contact_time,onset_utc,"
    "device,"
    "simulated,missed_ticks,attempt,protocol_sha256,program_version,participant_number,started_"
    "inside,"
    "ticks,longest_period,faults,max_force,observer_sha256\r\n";
constexpr const char* kAttemptColumns =
    "participant_id,session,block,trial,attempt,renderer,shape,orientation_w,orientation_x,"
    "orientation_y,orientation_z,practice,began_utc,reason,device,simulated,protocol_sha256,"
    "program_version,participant_number\r\n";

/// One line of RFC 4180.
class Line {
 public:
  Line& operator<<(std::string_view text) {
    separate();
    if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
      line_ += text;
      return *this;
    }
    line_ += '"';
    for (const char c : text) line_.append(c == '"' ? 2 : 1, c);
    line_ += '"';
    return *this;
  }
  Line& operator<<(bool value) {
    separate();
    line_ += value ? '1' : '0';
    return *this;
  }
  /// The shortest text that reads back as the same number; never a decimal comma.
  template <class Number>
  requires std::is_arithmetic_v<Number> Line& operator<<(Number value) {
    separate();
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
    line_.append(text.data(), end.ptr);
    return *this;
  }
  template <class T>
  Line& operator<<(const std::optional<T>& value) {
    return value ? *this << *value : *this << std::string_view();
  }

  std::string end() { return std::move(line_ += "\r\n"); }

 private:
  void separate() {
    if (!first_) line_ += ',';
    first_ = false;
  }
  std::string line_;
  bool first_ = true;
};

std::string trial_line(const StoredTrial& trial) {
  const TrialRecord& record = trial.record;
  Line line;
  line << trial.participant.code << record.session << record.block << record.trial
       << record.renderer << record.shape << record.response << record.correct
       << record.response_time;
  for (const double q : record.orientation_wxyz) line << q;
  line << record.practice << record.timed_out << record.first_contact_time << record.onset_utc
       << trial.run.device << trial.participant.simulated << record.missed_ticks << record.attempt
       << trial.protocol_sha256 << trial.run.program_version << trial.participant.number
       << record.started_inside << record.ticks
       << static_cast<double>(record.longest_period_ns) / 1e9 << record.faults << record.max_force
       << trial.run.observer_sha256;
  return line.end();
}

std::string attempt_line(const StoredTrial& trial) {
  const TrialRecord& record = trial.record;
  Line line;
  line << trial.participant.code << record.session << record.block << record.trial << record.attempt
       << record.renderer << record.shape;
  for (const double q : record.orientation_wxyz) line << q;
  line << record.practice << record.onset_utc << trial.cut_off_reason << trial.run.device
       << trial.participant.simulated << trial.protocol_sha256 << trial.run.program_version
       << trial.participant.number;
  return line.end();
}

/// A file that appears whole, under its name, or not at all.
class NewFile {
 public:
  explicit NewFile(const fs::path& path) : path_(path), draft_(path.string() + ".XXXXXX") {
    descriptor_ = ::mkostemp(draft_.data(), O_CLOEXEC);  // 0600: the data are about people
    if (descriptor_ < 0) {
      const int error = errno;
      draft_.clear();
      fail("cannot be created", error);
    }
  }
  ~NewFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!draft_.empty()) ::unlink(draft_.c_str());
  }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(std::string_view text) {
    buffer_ += text;
    constexpr std::size_t kEnough = 1 << 16;
    if (buffer_.size() >= kEnough) flush();
  }

  /// Everything is on the disk; only the name is missing.
  void finish() {
    flush();
    if (::fsync(descriptor_) != 0) fail("cannot be written", errno);
    if (::close(std::exchange(descriptor_, -1)) != 0) fail("cannot be written", errno);
  }

  void give_name(bool force) {
    const unsigned flags = force ? 0 : RENAME_NOREPLACE;
    int status = ::renameat2(AT_FDCWD, draft_.c_str(), AT_FDCWD, path_.c_str(), flags);
    if (status != 0 && errno == EINVAL) status = std::rename(draft_.c_str(), path_.c_str());
    if (status != 0) fail("cannot be given its name", errno);
    draft_.clear();
  }

 private:
  void flush() {
    for (std::string_view rest = buffer_; !rest.empty();) {
      const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail("cannot be written", errno);
      rest.remove_prefix(static_cast<std::size_t>(written));
    }
    buffer_.clear();
  }
  [[noreturn]] void fail(const char* what, int error) const {
    throw StoreError(
        path_.string() + ": " + what + ": " + std::generic_category().message(error) +
        "; nothing was exported. Check the folder, its permissions and the free space");
  }
  fs::path path_;
  std::string draft_, buffer_;
  int descriptor_ = -1;
};

void require_place(const fs::path& path, bool force) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return;
  if (!fs::is_regular_file(status)) {
    throw StoreRefused(path.string() + ": is not a file; name the CSV file to be written");
  }
  if (!force)
    throw StoreRefused(path.string() +
                       ": is there already; give --force to replace it, or another name");
}

}  // namespace

CsvExport export_csv(Store& store, const std::string& path, bool force) {
  const fs::path trials_path(path);
  const fs::path attempts_path = trials_path.parent_path() / "attempts.csv";
  if (trials_path.filename().empty())
    throw StoreRefused("'" + path + "' names no file to write to");
  if (trials_path.filename() == attempts_path.filename()) {
    throw StoreRefused(path +
                       ": that name is kept for the attempts that were cut off; choose another");
  }
  for (const char* end : {"", "-wal", "-shm", ".lock"}) {
    std::error_code error;
    if (fs::equivalent(trials_path, store.path() + end, error) && !error) {
      throw StoreRefused(path + ": is the database itself; name another file");
    }
  }
  const bool with_attempts = store.counts().cut_off > 0;
  require_place(trials_path, force);
  if (with_attempts) require_place(attempts_path, force);

  CsvExport done;
  NewFile trials(trials_path);
  trials.write(kTrialColumns);
  store.for_each_trial([&](const StoredTrial& trial) {
    trials.write(trial_line(trial));
    ++done.trials;
  });
  trials.finish();
  if (with_attempts) {
    NewFile attempts(attempts_path);
    attempts.write(kAttemptColumns);
    store.for_each_cut_off([&](const StoredTrial& trial) {
      attempts.write(attempt_line(trial));
      ++done.attempts;
    });
    attempts.finish();
    attempts.give_name(force);
    done.attempts_path = attempts_path.string();
  }
  trials.give_name(force);
  return done;
}

}  // namespace palpate
