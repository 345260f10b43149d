#pragma once
// Checks the messages of clients of `palpate serve`: later code never sees unchecked text. All
// messages are defined in protocols/serve.schema.json.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::runner::serve {

inline constexpr int kServeVersion = 1;
inline constexpr std::size_t kLongestMessage = 64 << 10;  ///< bytes; kLongestScene for `load`
inline constexpr std::size_t kLongestScene = 1 << 20;

/// The reason why a message is refused.
struct Refusal {
  std::string code;     ///< for programs, such as "bad-message"
  std::string message;  ///< for people
  std::string place;    ///< JSON pointer, in the message or the scene
};

/// All reasons, in order.
class MessageRefused : public std::runtime_error {
 public:
  explicit MessageRefused(std::vector<Refusal> why, std::optional<std::int64_t> id = {});
  MessageRefused(std::string code, std::string message, std::string place = "")
      : MessageRefused({Refusal{std::move(code), std::move(message), std::move(place)}}) {}
  const std::vector<Refusal>& why() const { return why_; }
  const std::optional<std::int64_t>& id() const { return id_; }  ///< if it could be read

 private:
  std::vector<Refusal> why_;
  std::optional<std::int64_t> id_;
};

enum class MessageType {
  hello,
  load,
  start,
  set,
  next,
  answer,
  stop,
  subscribe,
  mark,
  note,
  clock,
  alive,
  emergency,
  clear,
  picture,
  bye
};

/// Fields that may follow time and tick in a row of a stream.
enum class StreamField { tip, tail, force, rendered, contact, depth, object, faults, lateness };

/// The object that a program wants to be felt in a trial or in one of its intervals.
struct Wanted {
  std::string stimulus, renderer;  ///< empty: not given
  std::optional<double> level;
  bool standard = false;  ///< of an interval: the others are compared with it
};

struct Message {
  MessageType type = MessageType::alive;
  std::int64_t id = 0;
  bool control = true;                ///< hello; false: it watches
  std::string token;                  ///< hello
  nlohmann::json scene;               ///< load
  Wanted wanted;                      ///< start
  std::vector<Wanted> intervals;      ///< start; empty: not given
  std::optional<Quat> orientation;    ///< start, unit
  std::optional<std::int64_t> trial;  ///< start
  std::string path;                   ///< set: a JSON pointer into the scene
  nlohmann::json value;               ///< set
  std::string text;                   ///< answer's response, stop's reason, mark's and note's text
  std::optional<std::int64_t> t_ns;   ///< answer
  bool clock_is_known = false;        ///< answer: ClientClock knows the offset
  std::optional<bool> correct;        ///< answer
  int code = 0;                       ///< mark
  double rate = 0;                    ///< subscribe: Hz, 0: no stream
  std::vector<StreamField> fields;    ///< subscribe
  nlohmann::json t_client;            ///< clock: returned unchanged
  std::optional<std::int64_t> seen;   ///< clock: ns, of the newest answer to `clock` received
  std::uint32_t times_off = 0;        ///< clear: LiveForces::times_off() on arrival
};

/// Time of an answer: its own if the client's clock is known, else its arrival.
inline std::int64_t answer_time(const Message& message, std::int64_t arrived_ns) {
  return message.clock_is_known ? message.t_ns.value_or(arrived_ns) : arrived_ns;
}
/// The name of that choice in replies.
inline const char* stamped_by(const Message& message) {
  return message.clock_is_known && message.t_ns ? "client" : "arrival";
}

/// Bounds the offset of a client's clock by its `clock` messages: a message was sent before its
/// arrival, and after the last answer that the client has seen.
class ClientClock {
 public:
  static constexpr double kWithin = 1e6;   ///< ns, of an answer's time
  static constexpr double kDrift = 50e-6;  ///< of two quartz clocks

  /// \param t_client  time of sending by the client's clock, ns. \param seen  when the last answer
  /// that it knew was sent, by the server's clock
  void take(double t_client, std::int64_t received_ns, std::optional<std::int64_t> seen);
  void answered(std::int64_t sent_ns) { sent_ns_ = sent_ns; }
  /// Whether its offset is known to kWithin.
  bool is_known(std::int64_t now_ns) const;

 private:
  void forget();
  // Server's clock less client's, ns, at at_ns_.
  double least_ = -kNever, most_ = kNever;
  std::int64_t at_ns_ = 0, sent_ns_ = 0;
  static constexpr double kNever = 1e300;
};

/// \throws MessageRefused with every fault
Message parse_message(const std::string& text);

/// {"re":id,"ok":true,...}. \param more  an object
std::string accepted(std::int64_t id,
                     const nlohmann::ordered_json& more = nlohmann::ordered_json::object());
/// The same for a refusal: {"re":id,"ok":false,"error":{...},...}
std::string refused(const std::optional<std::int64_t>& id, const std::vector<Refusal>& why,
                    const nlohmann::ordered_json& more = nlohmann::ordered_json::object());
/// The contents of a mark or a note: {"code":...,"text":...}, the code of a mark alone.
nlohmann::ordered_json remark(const Message& message);
/// {"event":name,"t_ns":t,...}
std::string event(const std::string& name, std::int64_t t_ns,
                  const nlohmann::ordered_json& more = nlohmann::ordered_json::object());

}  // namespace palpate::runner::serve
