#include "runner/serve/messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

#include "data/base/utf8.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "protocols/parse.h"

namespace palpate::runner::serve {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

struct NamedType {
  const char* name;
  MessageType type;
};
constexpr NamedType kTypes[] = {
    {"hello", MessageType::hello},         {"load", MessageType::load},
    {"start", MessageType::start},         {"set", MessageType::set},
    {"next", MessageType::next},           {"answer", MessageType::answer},
    {"stop", MessageType::stop},           {"subscribe", MessageType::subscribe},
    {"mark", MessageType::mark},           {"note", MessageType::note},
    {"clock", MessageType::clock},         {"alive", MessageType::alive},
    {"emergency", MessageType::emergency}, {"clear", MessageType::clear},
    {"picture", MessageType::picture},     {"bye", MessageType::bye}};

constexpr std::pair<const char*, StreamField> kFields[] = {
    {"tip", StreamField::tip},          {"tail", StreamField::tail},
    {"force", StreamField::force},      {"rendered", StreamField::rendered},
    {"contact", StreamField::contact},  {"depth", StreamField::depth},
    {"object", StreamField::object},    {"faults", StreamField::faults},
    {"lateness", StreamField::lateness}};

constexpr std::size_t kLongestText = 1000;  // characters, as JSON schemas count them
constexpr double kMostRate = 1000;          // Hz

/// Reads the members of one message and collects their faults.
class MemberReader {
 public:
  /// \param pointer  of the object in the message
  explicit MemberReader(const json& object, std::string pointer = "")
      : object_(object), pointer_(std::move(pointer)) {}

  const json* member(const char* key, bool required) {
    known_.emplace_back(key);
    const auto found = object_.find(key);
    if (found != object_.end()) return &*found;
    if (required) fault(key, "expected; it is missing");
    return nullptr;
  }
  void text(const char* key, std::string& out, bool required, std::size_t most = kLongestText) {
    const json* const value = member(key, required);
    if (value == nullptr) return;
    if (!value->is_string() || count_characters(value->get_ref<const std::string&>()) > most)
      return fault(key, "expected a text of at most " + std::to_string(most) + " characters");
    out = value->get<std::string>();
  }
  std::optional<std::int64_t> integer(const char* key, bool required, std::int64_t least,
                                      std::int64_t most) {
    const json* const value = member(key, required);
    if (value == nullptr) return {};
    if (value->is_number_integer() &&
        !(value->is_number_unsigned() && value->get<std::uint64_t>() > std::uint64_t{INT64_MAX})) {
      const auto number = value->get<std::int64_t>();
      if (number >= least && number <= most) return number;
    } else if (value->is_number_float()) {  // 3.0 counts as a whole number
      constexpr double kExact = 9007199254740992;
      const auto number = value->get<double>();
      if (std::abs(number) <= kExact && number == std::floor(number) &&
          number >= static_cast<double>(least) && number <= static_cast<double>(most))
        return static_cast<std::int64_t>(number);
    }
    fault(key,
          "expected a whole number from " + std::to_string(least) + " to " + std::to_string(most));
    return {};
  }
  std::optional<double> number(const char* key, double least, double most) {
    const json* const value = member(key, false);
    if (value == nullptr) return {};
    if (value->is_number() && value->get<double>() >= least && value->get<double>() <= most)
      return value->get<double>();
    fault(key, "expected a number");
    return {};
  }
  bool has(const char* key) const { return object_.contains(key); }
  void fault(const std::string& key, const std::string& expected) {
    faults_.push_back({"bad-message", expected, protocols::child_pointer(pointer_, key)});
  }
  void refuse_unknown() {
    for (const auto& [key, value] : object_.items())
      if (std::ranges::find(known_, key) == known_.end()) fault(key, "no such key in this message");
  }
  std::vector<Refusal>& faults() { return faults_; }

 private:
  const json& object_;
  const std::string pointer_;
  std::vector<std::string> known_;
  std::vector<Refusal> faults_;
};

/// The field with the name used in messages; empty: none.
std::optional<StreamField> stream_field(const std::string& name) {
  for (const auto& [known, field] : kFields)
    if (name == known) return field;
  return {};
}

void read_fields(MemberReader& reader, Message& out) {
  const json* const fields = reader.member("fields", false);
  if (fields == nullptr) {
    out.fields = {StreamField::tip, StreamField::force};
    return;
  }
  bool good = fields->is_array() && fields->size() <= std::size(kFields);
  for (std::size_t i = 0; good && i < fields->size(); ++i) {
    const auto field = (*fields)[i].is_string() ? stream_field((*fields)[i].get<std::string>())
                                                : std::optional<StreamField>();
    good = field && std::ranges::find(out.fields, *field) == out.fields.end();
    if (good) out.fields.push_back(*field);
  }
  if (good) return;
  std::string names;
  for (const auto& [name, field] : kFields) names += std::string(names.empty() ? "" : ", ") + name;
  reader.fault("fields", "expected a list of some of " + names + ", each once");
}

void read_hello(MemberReader& reader, Message& out) {
  reader.text("token", out.token, true, 64);
  reader.integer("version", true, kServeVersion, kServeVersion);
  std::string role = "control";
  reader.text("role", role, false);
  if (role != "control" && role != "watch") reader.fault("role", "expected control or watch");
  out.control = role == "control";
}

void read_orientation(MemberReader& reader, Message& out) {
  constexpr double kRoundings = 1e-3;  // tolerated deviation of a unit quaternion's length
  const json* const value = reader.member("orientation_wxyz", false);
  if (value == nullptr) return;
  bool good = value->is_array() && value->size() == 4;
  double q[4] = {1, 0, 0, 0};
  for (std::size_t i = 0; good && i < 4; ++i) {
    good = (*value)[i].is_number();
    if (good) q[i] = (*value)[i].get<double>();
  }
  const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!good || !(std::abs(size - 1) <= kRoundings))
    return reader.fault("orientation_wxyz", "expected a unit quaternion, four numbers");
  // Keep a unit quaternion to the bit: it may come from a schedule or a record.
  constexpr double kLastBits = 4 * std::numeric_limits<double>::epsilon();
  const double scale = std::abs(size - 1) <= kLastBits ? 1 : size;
  out.orientation = Quat(q[0] / scale, q[1] / scale, q[2] / scale, q[3] / scale);
}

void read_wanted(MemberReader& reader, Wanted& out) {
  reader.text("stimulus", out.stimulus, false);
  reader.text("renderer", out.renderer, false);
  if (reader.has("renderer") && out.renderer != "point" && out.renderer != "ray")
    reader.fault("renderer", "expected point or ray");
  out.level = reader.number("level", -1e9, 1e9);
}

void read_intervals(MemberReader& reader, Message& out) {
  constexpr std::size_t kMostIntervals = 10;
  const json* const list = reader.member("intervals", false);
  if (list == nullptr) return;
  if (!list->is_array() || list->empty() || list->size() > kMostIntervals)
    return reader.fault("intervals", "expected a list of 1 to 10 intervals");
  for (const char* const key : {"stimulus", "renderer", "level"}) {
    if (reader.has(key)) reader.fault(key, "expected in each of the intervals instead");
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string place = protocols::child_pointer("/intervals", i);
    if (!(*list)[i].is_object()) {
      reader.faults().push_back({"bad-message", "expected an object", place});
      continue;
    }
    MemberReader interval((*list)[i], place);
    Wanted& wanted = out.intervals.emplace_back();
    read_wanted(interval, wanted);
    if (const json* const standard = interval.member("standard", false)) {
      if (standard->is_boolean())
        wanted.standard = standard->get<bool>();
      else
        interval.fault("standard", "expected true or false");
    }
    interval.refuse_unknown();
    std::ranges::move(interval.faults(), std::back_inserter(reader.faults()));
  }
}

void read_rest(MemberReader& reader, Message& out) {
  constexpr std::int64_t kMost = INT64_MAX;
  switch (out.type) {
    case MessageType::hello:
      read_hello(reader, out);
      break;
    case MessageType::load:
      if (const json* const scene = reader.member("scene", true)) {
        if (scene->is_object())
          out.scene = *scene;
        else
          reader.fault("scene", "expected an object, a scene as in scene.schema.json");
      }
      break;
    case MessageType::start:
      read_wanted(reader, out.wanted);
      read_intervals(reader, out);
      read_orientation(reader, out);
      out.trial = reader.integer("trial", false, 1, 1'000'000'000);
      break;
    case MessageType::set:
      reader.text("path", out.path, true);
      if (!out.path.starts_with("/objects/"))
        reader.fault("path",
                     "expected a JSON pointer into the scene, as /objects/0/damping_ns_per_m");
      if (const json* const value = reader.member("value", true)) out.value = *value;
      break;
    case MessageType::answer:
      reader.text("response", out.text, true);
      out.t_ns = reader.integer("t_ns", false, 0, kMost);
      if (const json* const correct = reader.member("correct", false)) {
        if (correct->is_boolean())
          out.correct = correct->get<bool>();
        else
          reader.fault("correct", "expected true or false");
      }
      break;
    case MessageType::stop:
      reader.text("reason", out.text, false);
      break;
    case MessageType::subscribe:
      if (const json* const rate = reader.member("rate_hz", true)) {
        if (rate->is_number() && rate->get<double>() >= 0 && rate->get<double>() <= kMostRate)
          out.rate = rate->get<double>();
        else
          reader.fault("rate_hz", "expected a number from 0 (no stream) to 1000");
      }
      read_fields(reader, out);
      break;
    case MessageType::mark:
      out.code = static_cast<int>(reader.integer("code", true, 1, 255).value_or(0));
      reader.text("text", out.text, false);
      break;
    case MessageType::note:
      reader.text("text", out.text, true);
      break;
    case MessageType::clock:
      if (const json* const time = reader.member("t_client", false)) {
        if (time->is_number())
          out.t_client = *time;
        else
          reader.fault("t_client", "expected a number");
      }
      out.seen = reader.integer("t_seen_ns", false, 0, kMost);
      break;
    case MessageType::next:
    case MessageType::alive:
    case MessageType::emergency:
    case MessageType::clear:
    case MessageType::picture:
    case MessageType::bye:
      break;
  }
}

json read_text(const std::string& text) {
  protocols::FaultList faults("message");
  try {
    json out = protocols::read_json(text, faults);
    faults.throw_if_any();
    return out;
  } catch (const protocols::InputError& error) {
    std::vector<Refusal> why;
    for (const protocols::Fault& fault : error.faults())
      why.push_back({"bad-json", fault.expected, fault.location});
    throw MessageRefused(std::move(why));
  }
}

}  // namespace

MessageRefused::MessageRefused(std::vector<Refusal> why, std::optional<std::int64_t> id)
    : std::runtime_error(why.empty() ? "refused" : why.front().message),
      why_(std::move(why)),
      id_(id) {}

Message parse_message(const std::string& text) {
  const json root = read_text(text);
  if (!root.is_object()) throw MessageRefused("bad-message", "expected an object");
  Message out;
  MemberReader reader(root);
  constexpr std::int64_t kMostId = std::int64_t{1} << 53;  // exact in JavaScript
  const auto id = reader.integer("id", true, 0, kMostId);
  out.id = id.value_or(0);
  std::string name;
  reader.text("type", name, true);
  const auto* const known =
      std::ranges::find_if(kTypes, [&](const NamedType& type) { return name == type.name; });
  if (known == std::end(kTypes)) {
    reader.fault("type", "no such message");
    throw MessageRefused(std::move(reader.faults()), id);
  }
  out.type = known->type;
  if (out.type != MessageType::load && text.size() > kLongestMessage)
    throw MessageRefused({{"too-long", "expected at most 64 kB", ""}}, id);
  read_rest(reader, out);
  reader.refuse_unknown();
  if (!reader.faults().empty()) throw MessageRefused(std::move(reader.faults()), id);
  return out;
}

void ClientClock::forget() {
  least_ = -kNever;
  most_ = kNever;
}

void ClientClock::take(double t_client, std::int64_t received_ns,
                       std::optional<std::int64_t> seen) {
  const double drift = kDrift * static_cast<double>(received_ns - at_ns_);
  at_ns_ = received_ns;
  const double most = static_cast<double>(received_ns) - t_client;
  most_ = std::min(most_ + drift, most);
  // A client cannot have seen an answer that was not sent.
  const bool credible = seen && *seen > 0 && *seen == sent_ns_;
  const double least = credible ? static_cast<double>(*seen) - t_client : -kNever;
  least_ = std::max(least_ - drift, least);
  if (least_ <= most_) return;
  forget();  // the client's clock was set
  most_ = most;
}

bool ClientClock::is_known(std::int64_t now_ns) const {
  const double drift = kDrift * static_cast<double>(now_ns - at_ns_);
  return (most_ - least_) / 2 + drift <= kWithin;
}

std::string accepted(std::int64_t id, const ordered_json& more) {
  ordered_json out = {{"re", id}, {"ok", true}};
  out.update(more);
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

ordered_json remark(const Message& message) {
  ordered_json out;
  if (message.type == MessageType::mark) out["code"] = message.code;
  out["text"] = message.text;
  return out;
}

std::string refused(const std::optional<std::int64_t>& id, const std::vector<Refusal>& why,
                    const ordered_json& more) {
  constexpr std::size_t kMostFaults = 20;
  const auto shown = [](const Refusal& refusal) {
    return ordered_json{
        {"code", refusal.code}, {"message", refusal.message}, {"place", refusal.place}};
  };
  ordered_json out = {{"re", id ? ordered_json(*id) : ordered_json()}, {"ok", false}};
  out["error"] = shown(why.front());
  if (why.size() > 1) {
    out["error"]["faults"] = ordered_json::array();
    for (std::size_t i = 0; i < std::min(why.size(), kMostFaults); ++i)
      out["error"]["faults"].push_back(shown(why[i]));
  }
  out.update(more);
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string event(const std::string& name, std::int64_t t_ns, const ordered_json& more) {
  ordered_json out = {{"event", name}, {"t_ns", t_ns}};
  out.update(more);
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace palpate::runner::serve
