#include "runner/session/markers.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "runner/servo/realtime.h"

namespace palpate::runner {
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
  }
  return "";
}

std::string to_json_line(const Marker& marker, std::int64_t sent_ns, bool with_code) {
  nlohmann::ordered_json line = {
      {"marker", to_string(marker.kind)},
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
  if (!with_code) line["participant_id"] = nullptr;
  if (marker.kind == Marker::Kind::response) line["response"] = marker.response;
  return line.dump() + "\n";
}

Markers::Markers(std::vector<std::unique_ptr<MarkerSink>> sinks) : sinks_(std::move(sinks)) {
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
  }
  came_.notify_one();
}

void Markers::work() {
  std::unique_lock lock(mutex_);
  while (!quit_ || !queue_.empty()) {
    came_.wait(lock, [this] { return quit_ || !queue_.empty(); });
    const std::vector<Marker> batch = std::exchange(queue_, {});
    lock.unlock();
    for (const Marker& marker : batch) {
      for (const auto& sink : sinks_) dropped_ += sink->send(marker) ? 0 : 1;
    }
    lock.lock();
  }
}

}  // namespace palpate::runner
