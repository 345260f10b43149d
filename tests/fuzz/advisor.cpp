// Whatever a program at the advisor's socket answers: the level is one that may be shown, or there
// is none and the reason is said.

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include "protocols/parse.h"
#include "protocols/tasks/levels.h"
#include "runner/session/socket_advisor.h"
#include "tests/fuzz/input_file.h"

namespace {

using palpate::protocols::Protocol;

constexpr const char* kProtocol = R"({"version": 2, "name": "asked", "renderers": ["point"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 300}],
  "blocks": [{"name": "stairs", "task": "compare", "stimuli": ["ball"], "standard": "ball",
    "level": {"path": "/stiffness_n_per_m"},
    "procedure": {"kind": "staircase", "start": 500, "min": 300, "max": 600, "steps": [50],
                  "down": 2, "stop": {"trials": 12}}}]})";

/// Listens at a path; a connection waits until it is accepted.
class Listener {
 public:
  explicit Listener(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    ::unlink(path.c_str());
    if (::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(socket_, 8) != 0)
      throw std::runtime_error(path + ": cannot listen");
  }
  ~Listener() { ::close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// The next connection gets these bytes, and no more.
  void answer(const std::uint8_t* data, std::size_t size) const {
    const int connection = ::accept(socket_, nullptr, nullptr);
    if (connection < 0 || (size > 0 && ::send(connection, data, size, MSG_NOSIGNAL) < 0))
      std::abort();
    ::shutdown(connection, SHUT_WR);
    ::close(connection);
  }

 private:
  int socket_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 4096) return 0;  // what a socket takes at once
  static const palpate::testing::InputFile file("socket");
  static const Listener listener(file.write(data, 0));
  static const Protocol protocol = palpate::protocols::parse_protocol_text(kProtocol, "p.json");
  palpate::protocols::Trial next;
  next.trial = 3;
  next.task_block = 0;
  next.level = 500;
  palpate::runner::session::SocketAdvisor advisor(
      protocol, {.path = file.path(), .time_out = 0.002, .participant = 1, .session = 1}, {});
  listener.answer(data, size);
  const auto proposal = advisor.ask(next);
  if (!proposal) {
    if (advisor.trouble().empty()) std::abort();
  } else if (!proposal->finished && !(*proposal->level >= 300 && *proposal->level <= 600)) {
    std::abort();
  }
  return 0;
}
