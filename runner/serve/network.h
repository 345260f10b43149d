#pragma once
// The network side of `palpate serve`: WebSocket on the loopback, lines of the same messages on a
// Unix socket, and the watchers' page. Runs in a thread of ordinary priority that does not touch
// the servo's state. It enforces roles, rates and sizes of messages.

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runner/serve/outlets.h"

namespace palpate::runner::serve {

struct NetworkSettings {
  std::uint16_t port = 0;  ///< of 127.0.0.1; 0: any free port
  std::string socket;      ///< path; empty: none
  std::string token;
  std::vector<std::string> origins;  ///< origins whose pages may connect
  /// HTML page for watchers; its style and script elements have the nonce @NONCE@.
  std::string page;
};

/// Functions that the network calls in its thread; they must not wait.
struct NetworkHooks {
  /// Zero force at once, until this client takes it back. \return false: it had asked before
  std::function<bool(std::uint64_t client)> emergency;
  std::function<bool(std::uint64_t client)> has_emergency;  ///< and has not taken it back
  std::function<void()> zero, silence;                      ///< zero force: at once; by the ramp
  std::function<bool()> forces_are_on;
  std::function<bool()> forces_may_come;     ///< on, or a scene is about to begin
  std::function<std::uint32_t()> times_off;  ///< LiveForces::times_off()
  std::function<nlohmann::json()> state;     ///< an object: part of the answer to hello
  std::function<std::string()> picture;      ///< of the scene: members of an answer, as JSON
  TickStream* ticks = nullptr;
  std::function<void()> wake;  ///< the session's thread: there is a command
};

/// Whether a program listens at this port of 127.0.0.1.
bool is_listening(std::uint16_t port);

class Network final : public ServeOutput {
 public:
  /// Listens, but accepts no client before begin(). \throws std::runtime_error naming the port or
  /// path
  explicit Network(NetworkSettings settings);
  ~Network() override;  ///< closes all connections and removes the socket
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  void begin(NetworkHooks hooks);
  /// Closes all connections; afterwards no hook is called.
  void end();
  std::uint16_t port() const;
  /// Commands since the last call, in order. For the session's thread.
  std::vector<ServeCommand> commands();

  void reply(std::uint64_t client, std::string text) override;
  void tell(std::string text) override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::runner::serve
