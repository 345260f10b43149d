#pragma once
// A server of pages for this computer's browser alone: HTTP on the loopback, without WebSockets.
// Its messages are POST requests with a token in a header of their own, so that a page of another
// origin would need the browser's permission first, which this server never gives.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace palpate::runner::serve {

struct PageAnswer {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};
};

struct PageHooks {
  /// Of a GET request, whose sender may not know the token. \param target  "/", "/report/12ab"
  std::function<PageAnswer(const std::string& target)> get;
  /// Of a POST request with the token.
  std::function<PageAnswer(const std::string& target, const std::string& body)> post;
  /// Of a POST request: whether another thread may answer it, so that others need not wait.
  std::function<bool(const std::string& target)> is_slow = [](const std::string&) { return false; };
};

class PageServer {
 public:
  /// Listens, but answers nothing before run(). \param port  0: any free one
  /// \param most_body  bytes of a message. \throws std::runtime_error naming the port
  PageServer(std::uint16_t port, std::string token, std::size_t most_body);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  std::uint16_t port() const;
  /// Calls the hooks in this thread, slow ones in another, each one at a time, until a signal asks
  /// the program to end.
  void run(PageHooks hooks);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::runner::serve
