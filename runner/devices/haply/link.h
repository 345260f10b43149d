#pragma once
// The connection to Haply's Inverse Service: a WebSocket, and single pages over HTTP.

#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace palpate::runner::devices::haply {

/// The connection has ended or cannot be made; what() gives the reason.
struct LinkError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Link {
 public:
  virtual ~Link() = default;
  /// Waits for the next message. False: it did not arrive in time; the next call continues to wait.
  /// The message is valid until the next call. \throws LinkError
  virtual bool receive(std::string_view& message, std::chrono::microseconds patience) = 0;
  /// \throws LinkError
  virtual void send(std::string_view message) = 0;
};

/// \param service  "HOST:PORT"; the documented one is 127.0.0.1:10001. \throws LinkError
std::unique_ptr<Link> connect(const std::string& service);
/// The body of the reply; empty: the status is not 200. \throws LinkError
std::string get(const std::string& service, const std::string& target);

}  // namespace palpate::runner::devices::haply
