// Faults of the disk: the current trial is never reported as saved.

#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

#include "data/export/csv.h"
#include "data/merge/merge.h"
#include "data/store/store.h"
#include "tests/data/store/sweep_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

Store open_to_write(const std::string& path) {
  return Store::open(path, Store::Mode::write_or_create);
}

/// Shows trials with samples until the store throws. \return the trial that was not saved.
int show_until_full(Store& store, const Run& run, std::string& error) {
  for (int trial = 1; trial < 1000; ++trial) {
    TrialRecord record = a_record(trial);
    record.samples.resize(2000);
    for (std::uint32_t i = 0; i < 2000; ++i) record.samples[i].depth = 1.0 / (i + 1.0);
    try {
      record.attempt = store.begin_attempt(run, record, 1);
      store.finish_attempt(run, record);
    } catch (const StoreError& full) {
      error = full.what();
      return trial;
    }
  }
  ADD_FAILURE() << "never full";
  return 0;
}

/// Runs `body` in a separate process with a disk of 1 MiB at `folder`. \return false: this machine
/// permits no mount.
bool on_a_small_disk(const std::string& folder, const std::function<void()>& body) {
  constexpr int kImpossible = 77;
  const uid_t user = ::getuid();
  const gid_t group = ::getgid();
  const pid_t child = ::fork();
  if (child == 0) {
    if (::unshare(CLONE_NEWNS) != 0) {
      if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) ::_exit(kImpossible);
      write_file("/proc/self/setgroups", "deny");
      write_file("/proc/self/uid_map", "0 " + std::to_string(user) + " 1");
      write_file("/proc/self/gid_map", "0 " + std::to_string(group) + " 1");
    }
    if (::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=1m") != 0) {
      ::_exit(kImpossible);
    }
    body();
    std::fflush(nullptr);
    ::_exit(::testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kImpossible) return false;
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "see above, status " << status;
  return true;
}

TEST(StoreFault, FullDiskSavesNoTrialAndSessionResumes) {
  const TemporaryFolder folder;
  const bool possible = on_a_small_disk(folder.path(), [&] {
    const std::string path = folder / "study.db";
    write_file(folder / "ballast", std::string(300'000, 'x'));
    Store store = open_to_write(path);
    const Participant person = store.enrol(a_protocol(), "A");
    const palpate::data::Run run = store.begin_run(person, a_run());
    std::string error;
    const int lost = show_until_full(store, run, error);
    EXPECT_GT(lost, 1);
    EXPECT_TRUE(contains(error, "disk is full")) << error;
    EXPECT_TRUE(contains(error, path)) << error;
    EXPECT_EQ(store.progress(person, 1).completed.size(), static_cast<std::size_t>(lost - 1));
    EXPECT_TRUE(
        contains(error_of([&] { export_csv(store, folder / "t.csv", false); }) + error_of([&] {
                   write_file(folder / "more", std::string(2'000'000, 'x'));
                   export_csv(store, folder / "t.csv", false);
                 }),
                 "nothing was exported"));
    fs::remove(folder / "ballast");
    fs::remove(folder / "more");
    store.end_run(run, RunEnd::aborted, 1);
    const palpate::data::Run again = store.begin_run(person, a_run());
    TrialRecord record = a_record(lost);
    record.attempt = store.begin_attempt(again, record, 1);
    store.finish_attempt(again, record);
    EXPECT_EQ(store.progress(person, 1).completed.size(), static_cast<std::size_t>(lost));
  });
  if (!possible) GTEST_SKIP() << "no small disk may be mounted here";
}

/// Message of the StoreError; empty: none.
std::string fault_of(const std::function<void()>& work) {
  try {
    work();
    return "";
  } catch (const StoreError& error) {
    return error.what();
  }
}

/// Creates with growing room, from none on. A failure reports a full disk, and a retry with room
/// succeeds. \param name of the file that appears complete or not at all
void expect_whole_or_not_at_all(const TemporaryFolder& folder, const std::string& name,
                                const std::function<void(const std::string& path)>& create,
                                const std::function<void(const std::string& path)>& read) {
  int failed = 0, done = 0;
  for (std::size_t room = 4096; room <= 700'000 && done < 3; room += 8192) {
    const std::string path = folder / name, ballast = folder / "ballast";
    write_file(ballast, std::string((1U << 20U) - room, 'x'));
    const std::string error = fault_of([&] { create(path); });
    if (error.empty()) {
      ++done;
    } else {
      ++failed;
      EXPECT_TRUE(contains(error, "disk is full") || contains(error, "No space left")) << error;
      EXPECT_TRUE(contains(error, name)) << error;
    }
    fs::remove(ballast);
    EXPECT_EQ(fault_of([&] { create(path); }), "") << room << " bytes free, then: " << error;
    EXPECT_EQ(fault_of([&] { read(path); }), "") << room;
    for (const auto& entry : fs::directory_iterator(folder.path())) fs::remove_all(entry.path());
  }
  EXPECT_GT(failed, 0);
  EXPECT_EQ(done, 3);
}

TEST(StoreFault, FullDiskLeavesNoBrokenFinalFile) {
  const TemporaryFolder folder, elsewhere;
  const std::string station = elsewhere / "station.db";
  {
    Store store = open_to_write(station);
    store.begin_run(store.enrol(a_protocol(), "A"), a_run());
  }
  const bool possible = on_a_small_disk(folder.path(), [&] {
    const auto reads = [](const std::string& path) { Store::open(path, Store::Mode::read_only); };
    expect_whole_or_not_at_all(
        folder, "study.db", [](const std::string& path) { open_to_write(path); }, reads);
    expect_whole_or_not_at_all(
        folder, "merged.db",
        [&](const std::string& path) {
          if (!fs::exists(path)) merge(path, {station});
        },
        reads);
    expect_whole_or_not_at_all(
        folder, "a.sweep", [](const std::string& path) { SweepFile::open(path, a_sweep_plan()); },
        [](const std::string& path) { SweepFile::open(path); });
  });
  if (!possible) GTEST_SKIP() << "no small disk may be mounted here";
}

TEST(StoreFault, ReadOnlyDiskReadsAndExplainsRefusedWrites) {
  const TemporaryFolder folder;
  const bool possible = on_a_small_disk(folder.path(), [&] {
    const std::string path = folder / "study.db";
    {
      Store store = open_to_write(path);
      const palpate::data::Run run =
          store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
      store.record_simulated(run, {a_record(1)});
    }
    ASSERT_EQ(::mount("none", folder.path().c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr), 0);
    Store reader = Store::open(path, Store::Mode::read_only);
    EXPECT_EQ(reader.counts().completed, 1);
    EXPECT_TRUE(contains(error_of([&] { open_to_write(path); }), "may write there"));
    EXPECT_TRUE(contains(error_of([&] { open_to_write(folder / "new.db"); }), "may write there"));
    EXPECT_TRUE(contains(error_of([&] { export_csv(reader, folder / "t.csv", false); }),
                         "cannot be created"));
  });
  if (!possible) GTEST_SKIP() << "no small disk may be mounted here";
}

TEST(StoreFault, FileThatMayNotGrowSavesNoTrial) {
  const TemporaryFolder folder;
  Store store = open_to_write(folder / "study.db");
  const Participant person = store.enrol(a_protocol(), "A");
  const palpate::data::Run run = store.begin_run(person, a_run());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{400'000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string error;
  const int lost = show_until_full(store, run, error);
  ::setrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, handler);
  EXPECT_GT(lost, 1);
  EXPECT_TRUE(contains(error, "not saved")) << error;
  EXPECT_EQ(store.progress(person, 1).completed.size(), static_cast<std::size_t>(lost - 1));
  EXPECT_EQ(store.counts().completed, lost - 1);
}

/// Changes of the files during a trial must never be reported as "saved".
void expect_not_saved_after(const std::function<void(const std::string& path)>& mishap) {
  const TemporaryFolder folder;
  const std::string path = folder / "study.db";
  Store store = open_to_write(path);
  const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "A"), a_run());
  store.begin_attempt(run, a_record(1), 1);
  mishap(path);
  const std::string error = error_of([&] { store.finish_attempt(run, a_record(1)); });
  EXPECT_TRUE(contains(error, path)) << error;
  EXPECT_TRUE(contains(error, "moved, replaced or deleted")) << error;
}

TEST(StoreFault, AVanishedFileIsNoticed) {
  expect_not_saved_after([](const std::string& path) { fs::remove(path); });
  expect_not_saved_after([](const std::string& path) { fs::remove(path + "-wal"); });
  expect_not_saved_after([](const std::string& path) { fs::rename(path, path + ".moved"); });
  expect_not_saved_after(
      [](const std::string& path) { fs::remove_all(fs::path(path).parent_path()); });
  expect_not_saved_after([](const std::string& path) {
    fs::copy_file(path, path + ".copy");
    fs::rename(path + ".copy", path);
  });
}

/// Root may write everything: for the lifetime of this object the test runs as nobody, the owner of
/// the folder.
class Unprivileged {
 public:
  explicit Unprivileged(const fs::path& folder) : was_root_(::geteuid() == 0) {
    constexpr ::uid_t kNobody = 65534;
    if (was_root_ && (::chown(folder.c_str(), kNobody, kNobody) != 0 || ::seteuid(kNobody) != 0)) {
      throw std::runtime_error("cannot become an unprivileged user");
    }
  }
  ~Unprivileged() {
    if (was_root_ && ::seteuid(0) != 0) std::abort();
  }
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;

 private:
  bool was_root_;
};

TEST(StoreFault, RefusesUnwritableFilesBeforeTheSession) {
  const TemporaryFolder folder;
  const Unprivileged unprivileged(folder.path());
  open_to_write(folder / "study.db");
  fs::permissions(folder / "study.db", fs::perms::owner_read);
  EXPECT_TRUE(contains(error_of([&] { open_to_write(folder / "study.db"); }), "cannot be written"));
  EXPECT_EQ(Store::open(folder / "study.db", Store::Mode::read_only).counts().runs, 0);
}

}  // namespace
}  // namespace palpate::data
