#pragma once
// A study of simulated participants for the page of palpate design: in a thread of its own, into a
// temporary database that nobody else sees and that is gone afterwards.

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "protocols/protocol.h"

namespace palpate::runner::design {

/// A folder that is removed with everything in it when this process ends, however it ends: a child
/// waits for that. Make it before there are threads.
class TemporaryFolder {
 public:
  TemporaryFolder();  ///< \throws std::runtime_error
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int life_ = -1;  ///< closed by the kernel when this process ends
  int child_ = -1;
};

class Rehearsal {
 public:
  struct Request {
    int participants = 2;
    std::uint64_t seed = 1;
  };

  explicit Rehearsal(const TemporaryFolder& folder) : folder_(folder) {}
  ~Rehearsal();
  Rehearsal(const Rehearsal&) = delete;
  Rehearsal& operator=(const Rehearsal&) = delete;

  /// \throws UsageError: one is running already, a person is in a session on this computer, or the
  /// simulated participants cannot do it; protocols::InputError
  void start(const std::string& text, const std::string& path, const Request& request);
  void stop() { stop_ = true; }
  /// {"state": "none" | "running" | "done" | "stopped" | "failed", "recorded", "expected",
  /// "report": KEY, "why"}
  nlohmann::ordered_json progress();
  /// The report of that key; nullopt: there is none (only the last ones are kept).
  std::optional<std::string> report(const std::string& key);

 private:
  void run(protocols::Protocol protocol, Request request);

  const TemporaryFolder& folder_;
  std::thread thread_;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;  ///< guards the rest
  nlohmann::ordered_json progress_{{"state", "none"}};
  std::deque<std::pair<std::string, std::string>> reports_;  ///< by key; the newest last
};

}  // namespace palpate::runner::design
