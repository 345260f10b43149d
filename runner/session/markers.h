#pragma once
// Event markers for other recorders (EEG, motion capture), sent as they happen. The session never
// waits for a receiver: what it does not take is counted and dropped.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "protocols/event_codes.h"

namespace palpate::runner::session {

struct Marker {
  enum class Kind : std::uint8_t {
    trial_start,  ///< time zero: forces go on
    first_contact,
    response,
    time_out,
    cut_off,   ///< the trial will be shown again
    interval,  ///< forces go on again, in a later interval of the trial
    sync,      ///< a second has passed; belongs to no trial
    mark,      ///< of the program that drives palpate serve, with a code of its own
  };
  Kind kind = Kind::trial_start;
  int code = 0;              ///< 1 to 255, from code_of(): the byte for a port; of a mark its own
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC, of the event itself
  std::string participant;
  int session = 0, block = 0, trial = 0, attempt = 0;
  std::string renderer, shape, response;  ///< response: empty except for Kind::response
};
const char* to_string(Marker::Kind kind);  ///< "trial_start", ...
/// The code of the answer if it has one, else of the kind; a mark's own.
int code_of(const Marker& marker, const protocols::EventCodes& codes);
/// Who may read a participant's code in a marker: network data is unencrypted.
enum class MarkerCodes {
  this_computer,  ///< only receivers on this computer; others get null
  everywhere,
};
/// One line of JSON with its newline; `sent_ns` is the present on the clock of time_ns.
std::string to_json_line(const Marker& marker, std::int64_t sent_ns, bool with_code);

/// A receiver of markers. send() is called in the markers' own thread.
class MarkerSink {
 public:
  virtual ~MarkerSink() = default;
  /// False: the receiver did not take it. Must not wait.
  virtual bool send(const Marker& marker) noexcept = 0;
};

/// Opens a sink from the user's text, "udp:HOST:PORT" or one of the others (kExpected in the
/// source). \throws std::invalid_argument for another text; std::runtime_error if it cannot be
/// opened.
std::unique_ptr<MarkerSink> open_marker_sink(const std::string& name, MarkerCodes codes);

class Markers {
 public:
  /// \param sync  from now on also send Kind::sync once a second
  explicit Markers(std::vector<std::unique_ptr<MarkerSink>> sinks,
                   protocols::EventCodes codes = protocols::usual_event_codes(), bool sync = false);
  /// Sends the remaining markers.
  ~Markers();
  Markers(const Markers&) = delete;
  Markers& operator=(const Markers&) = delete;

  /// From the session's thread; returns at once.
  void send(const Marker& marker);
  /// The number of markers that a receiver did not take.
  std::uint64_t dropped() const noexcept { return dropped_.load(); }

 private:
  void work();

  const std::vector<std::unique_ptr<MarkerSink>> sinks_;
  const protocols::EventCodes codes_;
  const bool sync_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<Marker> queue_;
  bool quit_ = false;
  std::atomic<std::uint64_t> dropped_{0};
  std::jthread thread_;  ///< not running without sinks
};

}  // namespace palpate::runner::session
