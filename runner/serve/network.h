#pragma once
// The network side of `palpate serve`: WebSocket on the loopback, lines of the same messages on a
// Unix socket, and the watchers' page. A thread of ordinary priority, which touches no state of the
// servo; it knows who may say what, how often and how much.

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runner/serve/outlets.h"

namespace palpate::runner {

struct NetworkSettings {
  std::uint16_t port = 0;  ///< of 127.0.0.1; 0: one that is free
  std::string socket;      ///< path; empty: none
  std::string token;
  std::vector<std::string> origins;  ///< whose pages may connect
  /// For watchers, as HTML; its elements of style and script have the nonce @NONCE@.
  std::string page;
};

/// What the network asks for. Called in its thread; must not wait.
struct NetworkHooks {
  std::function<void()> emergency, silence;  ///< zero force at once; by the ramp: nobody steers
  std::function<bool()> forces_are_on;
  std::function<nlohmann::json()> state;  ///< an object: the answer to hello has its members
  std::function<std::string()> picture;   ///< of what is felt: the members of an answer, as JSON
  TickStream* ticks = nullptr;
};

/// 128 bits as 32 hexadecimal digits, from the kernel. \throws std::runtime_error
std::string make_token();

class Network final : public ServeOutput {
 public:
  /// Listens, but serves nobody before begin(). \throws std::runtime_error that names the
  /// port or path
  explicit Network(NetworkSettings settings);
  ~Network() override;  ///< closes all connections and removes the socket
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  void begin(NetworkHooks hooks);
  /// Closes all connections; from then on no hook is called.
  void end();
  std::uint16_t port() const;
  /// Commands since the last call, in order. By the session's thread.
  std::vector<ServeCommand> commands();

  void reply(std::uint64_t client, std::string text) override;
  void tell(std::string text) override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::runner
