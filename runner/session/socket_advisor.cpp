#include "runner/session/socket_advisor.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "data/base/cell_name.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "protocols/groups.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"

namespace palpate::runner::session {
namespace {

using AdvisorJson = nlohmann::ordered_json;
using std::chrono::steady_clock;

constexpr std::size_t kMostShown = 80;  // bytes of a quotation

std::string line_of(const AdvisorJson& message) {
  return message.dump(-1, ' ', false, AdvisorJson::error_handler_t::replace) + "\n";
}

AdvisorJson json_of(const data::TrialRecord& record) {
  const data::TaskRecord& task = record.task;
  return {{"trial", record.trial},
          {"block", task.block_name},
          {"track", task.track},
          {"level", task.level ? AdvisorJson(*task.level) : AdvisorJson()},
          {"success", task.success},
          {"correct", record.correct},
          {"answered", !record.timed_out},
          {"catch_trial", task.catch_trial},
          {"response", record.timed_out ? AdvisorJson() : AdvisorJson(record.response)},
          {"response_time_s", record.response_time}};
}

int milliseconds_until(steady_clock::time_point until) {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(until - steady_clock::now()).count();
  return static_cast<int>(std::clamp<long long>(left, 0, 60'000));
}

/// A connected socket; -1: none, and `trouble` has the reason.
int open_socket(const std::string& path, std::string& trouble) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    trouble = "the path of a socket has at most " + std::to_string(sizeof address.sun_path - 1) +
              " bytes";
    return -1;
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int opened = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (opened >= 0 &&
      ::connect(opened, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return opened;
  trouble = std::string("nobody listens there: ") + std::strerror(errno);
  if (opened >= 0) ::close(opened);
  return -1;
}

}  // namespace

std::string socket_fault(const std::string& path) {
  std::string trouble;
  const int opened = open_socket(path, trouble);
  if (opened >= 0) ::close(opened);
  return trouble;
}

SocketAdvisor::SocketAdvisor(const protocols::Protocol& protocol, Settings settings,
                             const std::vector<data::TrialRecord>& history)
    : protocol_(protocols::protocol_of(protocol, settings.participant)),
      group_(protocol.groups.any() ? protocol.groups.name(settings.participant) : ""),
      settings_(std::move(settings)) {
  for (const data::TrialRecord& record : history) {
    if (!record.task.of_block()) continue;
    history_ += (history_.empty() ? "" : ",") + json_of(record).dump();
  }
  if (!connect()) throw std::invalid_argument(settings_.path + ": " + trouble_);
}

SocketAdvisor::~SocketAdvisor() { disconnect(); }

bool SocketAdvisor::connect() {
  socket_ = open_socket(settings_.path, trouble_);
  if (socket_ < 0) return false;
  AdvisorJson begin{{"type", "begin"},
                    {"version", 1},
                    {"protocol", protocol_.name},
                    {"participant", settings_.participant},
                    {"group", group_.empty() ? AdvisorJson() : AdvisorJson(group_)},
                    {"session", settings_.session}};
  std::string line = line_of(begin);
  line.resize(line.size() - 2);  // "}\n"
  return send(line + ",\"history\":[" + history_ + "]}\n");
}

void SocketAdvisor::disconnect() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
  received_.clear();
}

/// Sends the whole line or fails: a peer that never reads fills its buffer.
bool SocketAdvisor::send(const std::string& line) {
  const auto until = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                               std::chrono::duration<double>(settings_.time_out));
  std::size_t sent = 0;
  while (sent < line.size()) {
    const ssize_t now = ::send(socket_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
    if (now > 0) {
      sent += static_cast<std::size_t>(now);
      continue;
    }
    if (now < 0 && errno == EINTR) continue;
    pollfd ready{socket_, POLLOUT, 0};
    const bool full = now < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
    if (full && ::poll(&ready, 1, milliseconds_until(until)) > 0) continue;
    trouble_ = full ? "it does not read what it is sent" : "it is gone";
    disconnect();
    return false;
  }
  return true;
}

std::optional<std::string> SocketAdvisor::receive(Deadline until) {
  while (true) {
    // A flood of old answers counts as no answer.
    if (steady_clock::now() >= until) {
      trouble_ = "no answer in time";
      return std::nullopt;
    }
    if (const std::size_t end = received_.find('\n'); end != std::string::npos) {
      std::string line = received_.substr(0, end);
      received_.erase(0, end + 1);
      return line;
    }
    if (received_.size() > kMostLine) {
      trouble_ = "it sent a line of more than " + std::to_string(kMostLine) + " bytes";
      send(refusal(trouble_, 0));
      disconnect();
      return std::nullopt;
    }
    pollfd ready{socket_, POLLIN, 0};
    const int found = ::poll(&ready, 1, milliseconds_until(until));
    if (found < 0 && errno == EINTR) continue;
    if (found <= 0) {
      trouble_ = "no answer in time";
      return std::nullopt;
    }
    std::array<char, 4096> bytes{};
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    if (count > 0) {
      received_.append(bytes.data(), static_cast<std::size_t>(count));
    } else if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
      trouble_ = "it is gone";
      disconnect();
      return std::nullopt;
    }
  }
}

std::string SocketAdvisor::refusal(const std::string& message, int trial) const {
  return line_of({{"type", "refused"}, {"trial", trial}, {"message", message}});
}

/// nullopt with trouble_: an invalid line; without: the level answers an earlier question.
std::optional<double> SocketAdvisor::level_in(const std::string& line,
                                              const protocols::Trial& next) {
  const std::string found = "; found " + printable(line, kMostShown);
  const auto message = json_or_discarded(line);
  if (!message.is_object() || !message.contains("trial") || !message["trial"].is_number_integer() ||
      message.value("type", nlohmann::json()) != "level") {
    trouble_ = R"(expected {"type": "level", "trial": )" + std::to_string(next.trial) +
               R"(, "level": X})" + found;
    return std::nullopt;
  }
  if (message["trial"].get<std::int64_t>() < next.trial) return std::nullopt;
  if (message["trial"] != next.trial) {
    trouble_ = "expected the answer to trial " + std::to_string(next.trial) + found;
    return std::nullopt;
  }
  const auto& block = protocols::block_of(protocol_, next);
  const std::vector<double> levels = protocols::levels_of(block);
  const auto level = message.value("level", nlohmann::json());
  const double value = level.is_number() ? level.get<double>() : NAN;
  if (value >= levels.front() && value <= levels.back()) return value;
  trouble_ = "expected a level from " + protocols::level_text(levels.front()) + " to " +
             protocols::level_text(levels.back()) + found;
  return std::nullopt;
}

std::optional<double> SocketAdvisor::ask(const protocols::Trial& next) {
  trouble_.clear();
  if (socket_ < 0 && !connect()) return std::nullopt;
  const auto& block = protocols::block_of(protocol_, next);
  const std::vector<double> levels = protocols::levels_of(block);
  const auto until = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                               std::chrono::duration<double>(settings_.time_out));
  const CellName stimulus =
      cell_name(protocol_.stimuli[static_cast<std::size_t>(next.stimulus)].name);
  AdvisorJson factors = AdvisorJson::object();
  for (const auto& [factor, level] : stimulus.levels) factors[factor] = level;
  const auto scale = protocols::scale_of(*protocols::procedure_of(block, next));
  if (!send(line_of({{"type", "ask"},
                     {"trial", next.trial},
                     {"block", block.name},
                     {"track", next.track},
                     {"stimulus", stimulus.base},
                     {"factors", factors},
                     {"scale", to_string(*scale)},
                     {"renderer", protocols::to_string(next.renderer)},
                     {"path", block.level->pointer},
                     {"least", levels.front()},
                     {"most", levels.back()},
                     {"own", *next.level}})))
    return std::nullopt;
  while (const std::optional<std::string> line = receive(until)) {
    const std::optional<double> level = level_in(*line, next);
    if (level) return level;
    if (trouble_.empty()) continue;
    const std::string why = trouble_;
    if (send(refusal(why, next.trial))) trouble_ = why;
    return std::nullopt;
  }
  return std::nullopt;
}

void SocketAdvisor::tell(const data::TrialRecord& record) {
  AdvisorJson message{{"type", "tell"}};
  message.update(json_of(record));
  history_ += (history_.empty() ? "" : ",") + json_of(record).dump();
  if (socket_ >= 0) send(line_of(message));
}

}  // namespace palpate::runner::session
