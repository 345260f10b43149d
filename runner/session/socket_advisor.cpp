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
#include "runner/scene_builder.h"
#include "runner/session/device_check.h"

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
  AdvisorJson out{{"trial", record.trial},
                  {"block", task.block_name},
                  {"track", task.track},
                  {"level", task.level ? AdvisorJson(*task.level) : AdvisorJson()},
                  {"success", task.success},
                  {"correct", record.correct},
                  {"answered", !record.timed_out},
                  {"catch_trial", task.catch_trial},
                  {"response", record.timed_out ? AdvisorJson() : AdvisorJson(record.response)},
                  {"response_time_s", record.response_time}};
  for (const auto& [name, value] : task.dimensions) out["levels"][name] = value;
  return out;
}

/// The key of a dimension's range in messages.
std::string range_text(const protocols::LevelDimension& dimension,
                       const protocols::DimensionRange& range) {
  return "'" + dimension.name + "' from " + protocols::level_text(range.min) + " to " +
         protocols::level_text(range.max);
}

/// The point that a program names. \param trouble  set if it is none, or beyond the ranges
protocols::LevelPoint point_in(const nlohmann::json& levels, const protocols::TaskBlock& block,
                               std::string& trouble) {
  protocols::LevelPoint point;
  if (!levels.is_object()) {
    trouble = "expected levels, an object with a number for each dimension";
    return point;
  }
  const std::vector<protocols::DimensionRange> ranges = protocols::ranges_of(block);
  for (std::size_t d = 0; d < block.dimensions.size() && trouble.empty(); ++d) {
    const protocols::LevelDimension& dimension = block.dimensions[d];
    const auto given = levels.find(dimension.name);
    const double value = given != levels.end() && given->is_number() ? given->get<double>() : NAN;
    if (given == levels.end())
      trouble = "expected a level for " + range_text(dimension, ranges[d]) + ": it is missing";
    else if (!(value >= ranges[d].min && value <= ranges[d].max))
      trouble = "expected a level for " + range_text(dimension, ranges[d]);
    point.push_back(value);
  }
  for (const auto& [name, value] : levels.items()) {
    const auto known = std::ranges::find(block.dimensions, name, &protocols::LevelDimension::name);
    if (trouble.empty() && known == block.dimensions.end())
      trouble = "expected no level for '" + printable(name, kMostShown) +
                "': the block has no such dimension";
  }
  if (!trouble.empty()) point.clear();
  return point;
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

/// The permitted answers about a trial.
AdvisorJson range_json(const protocols::TaskBlock& block, const protocols::Trial& next) {
  AdvisorJson out;
  if (block.dimensions.empty()) {
    const std::vector<double> levels = protocols::levels_of(block);
    out["path"] = block.level->pointer;
    out["least"] = levels.front();
    out["most"] = levels.back();
    out["own"] = *next.level;
    return out;
  }
  const std::vector<protocols::DimensionRange> ranges = protocols::ranges_of(block);
  out["dimensions"] = AdvisorJson::array();
  for (std::size_t d = 0; d < ranges.size(); ++d) {
    const protocols::LevelDimension& one = block.dimensions[d];
    out["dimensions"].push_back({{"name", one.name},
                                 {"path", one.target.pointer},
                                 {"of", protocols::to_string(one.of)},
                                 {"scale", to_string(one.scale)},
                                 {"least", ranges[d].min},
                                 {"most", ranges[d].max}});
    out["own"][one.name] = next.point[d];
  }
  return out;
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

std::string SocketAdvisor::fault_of(const protocols::LevelPoint& point,
                                    const protocols::Trial& next) const {
  const auto& block = protocols::block_of(protocol_, next);
  protocols::Protocol shown = protocol_;
  shown.blocks.clear();
  shown.stimuli.clear();
  shown.stimulus_texts.clear();
  try {
    for (const protocols::Interval& interval : next.intervals) {
      if (interval.stimulus >= 0 && !interval.point.empty())
        shown.stimuli.push_back(
            protocols::at_point(protocol_, block, interval.stimulus, point, interval.standard));
    }
    if (settings_.device == nullptr) return "";
    const std::vector<std::string> reasons =
        incompatibilities(shown, StimulusLibrary(shown), *settings_.device);
    return reasons.empty() ? "" : reasons.front();
  } catch (const protocols::InputError& error) {
    return error.faults().front().location + ": " + error.faults().front().expected;
  } catch (const stimuli::MeshError& error) {
    return error.what();
  }
}

/// nullopt with trouble_: an invalid line; without: it answers an earlier question.
std::optional<Proposal> SocketAdvisor::proposal_in(const std::string& line,
                                                   const protocols::Trial& next) {
  const std::string found = "; found " + printable(line, kMostShown);
  const auto& block = protocols::block_of(protocol_, next);
  const bool several = !block.dimensions.empty();
  const char* const kind = several ? "levels" : "level";
  const auto message = json_or_discarded(line);
  const auto type = message.is_object() ? message.value("type", nlohmann::json()) : nullptr;
  const bool finished = type == "finished";
  if (finished && !message.contains("trial")) return Proposal{.finished = true};
  if (!message.is_object() || !message.contains("trial") || !message["trial"].is_number_integer() ||
      (type != kind && !finished)) {
    trouble_ = R"(expected {"type": ")" + std::string(kind) + R"(", "trial": )" +
               std::to_string(next.trial) + R"(, ")" + kind + R"(": )" +
               (several ? "{NAME: X, ...}}" : "X}") + found;
    return std::nullopt;
  }
  if (message["trial"].get<std::int64_t>() < next.trial) return std::nullopt;
  if (message["trial"] != next.trial) {
    trouble_ = "expected the answer to trial " + std::to_string(next.trial) + found;
    return std::nullopt;
  }
  if (finished) return Proposal{.finished = true};
  if (several) {
    protocols::LevelPoint point =
        point_in(message.value("levels", nlohmann::json()), block, trouble_);
    if (trouble_.empty()) {
      const std::string fault = fault_of(point, next);
      if (fault.empty()) return Proposal{.point = std::move(point)};
      trouble_ = "expected levels that can be shown: at " + protocols::point_text(block, point) +
                 ", " + fault;
    }
    trouble_ += found;
    return std::nullopt;
  }
  const std::vector<double> levels = protocols::levels_of(block);
  const auto level = message.value("level", nlohmann::json());
  const double value = level.is_number() ? level.get<double>() : NAN;
  if (value >= levels.front() && value <= levels.back()) return Proposal{.level = value};
  trouble_ = "expected a level from " + protocols::level_text(levels.front()) + " to " +
             protocols::level_text(levels.back()) + found;
  return std::nullopt;
}

std::optional<Proposal> SocketAdvisor::ask(const protocols::Trial& next) {
  trouble_.clear();
  if (socket_ < 0 && !connect()) return std::nullopt;
  const auto& block = protocols::block_of(protocol_, next);
  const auto until = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                               std::chrono::duration<double>(settings_.time_out));
  const CellName stimulus =
      cell_name(protocol_.stimuli[static_cast<std::size_t>(next.stimulus)].name);
  AdvisorJson factors = AdvisorJson::object();
  for (const auto& [factor, level] : stimulus.levels) factors[factor] = level;
  AdvisorJson question{{"type", "ask"},       {"trial", next.trial},       {"block", block.name},
                       {"track", next.track}, {"stimulus", stimulus.base}, {"factors", factors}};
  if (const auto scale = protocols::scale_of(*protocols::procedure_of(block, next)))
    question["scale"] = to_string(*scale);
  question["renderer"] = protocols::to_string(next.renderer);
  question.update(range_json(block, next));
  if (!send(line_of(question))) return std::nullopt;
  while (const std::optional<std::string> line = receive(until)) {
    const std::optional<Proposal> proposal = proposal_in(*line, next);
    if (proposal) return proposal;
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
