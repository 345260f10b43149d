#include "runner/session/markers.h"

#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "runner/servo/realtime.h"

namespace palpate::runner::session {
namespace {

constexpr std::size_t kMostWaiting = 1000;

}  // namespace

const char* to_string(Marker::Kind kind) {
  switch (kind) {
    case Marker::Kind::trial_start:
      return "trial_start";
    case Marker::Kind::first_contact:
      return "first_contact";
    case Marker::Kind::response:
      return "response";
    case Marker::Kind::time_out:
      return "time_out";
    case Marker::Kind::cut_off:
      return "cut_off";
    case Marker::Kind::interval:
      return "interval";
    case Marker::Kind::sync:
      return "sync";
    case Marker::Kind::mark:
      return "mark";
  }
  return "";
}

int code_of(const Marker& marker, const protocols::EventCodes& codes) {
  if (marker.kind == Marker::Kind::mark) return marker.code;
  if (marker.kind == Marker::Kind::response) {
    const auto own = codes.find("response:" + marker.response);
    if (own != codes.end()) return own->second;
  }
  return codes.at(to_string(marker.kind));
}

std::string to_json_line(const Marker& marker, std::int64_t sent_ns, bool with_code) {
  nlohmann::ordered_json line = {
      {"marker", to_string(marker.kind)},
      {"code", marker.code},
      {"time_ns", marker.time_ns},
      {"sent_ns", sent_ns},
      {"participant_id", marker.participant},
      {"session", marker.session},
      {"block", marker.block},
      {"trial", marker.trial},
      {"attempt", marker.attempt},
      {"renderer", marker.renderer},
      {"shape", marker.shape},
  };
  if (!with_code || marker.kind == Marker::Kind::sync) line["participant_id"] = nullptr;
  if (marker.kind == Marker::Kind::response) line["response"] = marker.response;
  return line.dump() + "\n";
}

Markers::Markers(std::vector<std::unique_ptr<MarkerSink>> sinks, protocols::EventCodes codes,
                 bool sync)
    : sinks_(std::move(sinks)), codes_(std::move(codes)), sync_(sync) {
  if (!sinks_.empty()) thread_ = std::jthread([this] { work(); });
}

Markers::~Markers() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  came_.notify_one();
}

void Markers::send(const Marker& marker) {
  if (sinks_.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    if (queue_.size() >= kMostWaiting) {
      ++dropped_;
      return;
    }
    queue_.push_back(marker);
    queue_.back().code = code_of(marker, codes_);
  }
  came_.notify_one();
}

void Markers::work() {
  using std::chrono::steady_clock;
  constexpr std::chrono::seconds kSecond(1);
  servo::RealClock clock;
  Marker second;
  second.kind = Marker::Kind::sync;
  second.code = code_of(second, codes_);
  steady_clock::time_point due = steady_clock::now();  // of the next sync
  const auto has_work = [this] { return quit_ || !queue_.empty(); };
  std::unique_lock lock(mutex_);
  while (!quit_ || !queue_.empty()) {
    if (sync_) {
      came_.wait_until(lock, due, has_work);
    } else {
      came_.wait(lock, has_work);
    }
    std::vector<Marker> batch = std::exchange(queue_, {});
    lock.unlock();
    if (sync_ && steady_clock::now() >= due) {
      second.time_ns = clock.now_ns();
      batch.push_back(second);
      while (due <= steady_clock::now()) due += kSecond;  // skip the missed ones
    }
    for (const Marker& marker : batch) {
      for (const auto& sink : sinks_) dropped_ += sink->send(marker) ? 0 : 1;
    }
    lock.lock();
  }
}

}  // namespace palpate::runner::session
