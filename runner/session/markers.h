#pragma once
// Event markers for other recordings (EEG, motion capture), sent as they happen. The session never
// waits for a receiver; markers that are not taken are counted and dropped.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace palpate::runner {

struct Marker {
  enum class Kind : std::uint8_t {  // the value is what the serial port gets
    trial_start = 1,                ///< time zero: forces go on
    first_contact = 2,
    response = 3,
    time_out = 4,
    cut_off = 5,   ///< the trial will be shown again
    interval = 6,  ///< forces go on again, in a further interval of the trial
  };
  Kind kind = Kind::trial_start;
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC, of the event itself
  std::string participant;
  int session = 0, block = 0, trial = 0, attempt = 0;
  std::string renderer, shape, response;  ///< response: empty but for Kind::response
};
const char* to_string(Marker::Kind kind);  ///< "trial_start", ...
/// Who may read a participant's code in a marker: what goes over a network goes in clear.
enum class MarkerCodes {
  this_computer,  ///< only receivers on this computer; others get null
  everywhere,
};
/// One line of JSON with its newline; `sent_ns` is the present on the clock of time_ns.
std::string to_json_line(const Marker& marker, std::int64_t sent_ns, bool with_code);

/// Where markers go. send() is called in the markers' own thread.
class MarkerSink {
 public:
  virtual ~MarkerSink() = default;
  /// False: the receiver did not take it. May not wait.
  virtual bool send(const Marker& marker) noexcept = 0;
};

/// From what the user names, "udp:HOST:PORT" or one of the others (kExpected in its source).
/// \throws std::invalid_argument for another text; std::runtime_error where it cannot be opened.
std::unique_ptr<MarkerSink> open_marker_sink(const std::string& name, MarkerCodes codes);

class Markers {
 public:
  explicit Markers(std::vector<std::unique_ptr<MarkerSink>> sinks);
  /// Sends what is left.
  ~Markers();
  Markers(const Markers&) = delete;
  Markers& operator=(const Markers&) = delete;

  /// From the session's thread; returns at once.
  void send(const Marker& marker);
  /// Not taken by a receiver.
  std::uint64_t dropped() const noexcept { return dropped_.load(); }

 private:
  void work();

  const std::vector<std::unique_ptr<MarkerSink>> sinks_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<Marker> queue_;
  bool quit_ = false;
  std::atomic<std::uint64_t> dropped_{0};
  std::jthread thread_;  ///< none where there is no sink
};

}  // namespace palpate::runner
