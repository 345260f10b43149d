#include "runner/serve/page_server.h"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <csignal>
#include <deque>
#include <exception>
#include <optional>

#include "runner/serve/loopback.h"

namespace palpate::runner::serve {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Code = boost::system::error_code;
using asio::ip::tcp;

constexpr auto kHeaderPatience = std::chrono::seconds(2);
constexpr auto kBodyPatience = std::chrono::seconds(20);
constexpr std::size_t kMostHeader = 8 << 10;  // bytes
constexpr std::size_t kMostConnections = 64;  // the oldest makes room
constexpr const char* kToken = "X-Palpate-Token";

/// One request and its answer; a connection carries no second one.
struct Exchange {
  explicit Exchange(tcp::socket socket) : stream(std::move(socket)) {
    parser.header_limit(kMostHeader);
  }
  beast::tcp_stream stream;
  beast::flat_buffer buffer;
  http::request_parser<http::string_body> parser;
  http::response<http::string_body> response;
  std::array<char, 4096> rest{};
};
using Shared = std::shared_ptr<Exchange>;

/// Reads and drops what still comes, until the client has read the answer: closing at once would
/// take it away from a client that still sends.
void drain(const Shared& exchange) {
  exchange->stream.async_read_some(asio::buffer(exchange->rest),
                                   [exchange](const Code& error, std::size_t) {
                                     if (!error) drain(exchange);
                                   });
}

void respond(const Shared& exchange, PageAnswer answer) {
  auto& response = exchange->response;
  response.version(11);
  response.result(answer.status);
  response.set(http::field::content_type, answer.type);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  for (const auto& [name, value] : answer.headers) response.set(name, value);
  response.keep_alive(false);
  response.body() = std::move(answer.body);
  response.prepare_payload();
  exchange->stream.expires_after(kBodyPatience);
  http::async_write(exchange->stream, response, [exchange](const Code& error, std::size_t) {
    Code ignored;
    exchange->stream.socket().shutdown(tcp::socket::shutdown_send, ignored);
    exchange->stream.expires_after(kHeaderPatience);
    if (!error) drain(exchange);
  });
}

void refuse(const Shared& exchange, http::status status, std::string why) {
  respond(exchange,
          {static_cast<unsigned>(status), "text/plain; charset=utf-8", std::move(why) + "\n"});
}

}  // namespace

class PageServer::Impl {
 public:
  Impl(std::uint16_t port, std::string token, std::size_t most_body)
      : token_(std::move(token)), most_body_(most_body), acceptor_(io_), signals_(io_) {
    listen_on_loopback(acceptor_, port);
  }

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

  void run(PageHooks hooks) {
    hooks_ = std::move(hooks);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) signals_.add(signal);
    signals_.async_wait([this](const Code& error, int) {
      if (!error) io_.stop();
    });
    accept();
    io_.run();
    worker_.stop();
    worker_.join();
  }

 private:
  void accept() {
    acceptor_.async_accept([this](const Code& error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) read_header(std::make_shared<Exchange>(std::move(socket)));
      accept();
    });
  }

  void make_room() {
    std::erase_if(open_, [](const auto& other) { return other.expired(); });
    if (open_.size() < kMostConnections) return;
    if (const Shared oldest = open_.front().lock()) oldest->stream.close();
    open_.pop_front();
  }

  void read_header(const Shared& exchange) {
    make_room();
    open_.push_back(exchange);
    exchange->parser.body_limit(most_body_);
    exchange->stream.expires_after(kHeaderPatience);
    http::async_read_header(exchange->stream, exchange->buffer, exchange->parser,
                            [this, exchange](const Code& error, std::size_t) {
                              if (error == http::error::body_limit) return too_large(exchange);
                              if (!error) greet(exchange);
                            });
  }

  void too_large(const Shared& exchange) const {
    refuse(exchange, http::status::payload_too_large,
           "at most " + std::to_string(most_body_) + " bytes");
  }

  /// Decides before the body is read.
  void greet(const Shared& exchange) {
    const auto& request = exchange->parser.get();
    const std::string host(request[http::field::host]), origin(request[http::field::origin]);
    if (!is_loopback_name(host))
      return refuse(exchange, http::status::forbidden, "Host: expected 127.0.0.1 or localhost");
    if (!origin.empty() && origin != "http://" + host)
      return refuse(exchange, http::status::forbidden, "Origin: this page may not send messages");
    if (request.method() == http::verb::get) return answer(exchange);
    if (request.method() != http::verb::post)
      return refuse(exchange, http::status::method_not_allowed, "expected GET or POST");
    if (!equal_in_constant_time(std::string(request[kToken]), token_))
      return refuse(exchange, http::status::forbidden, "this is not the server's token");
    if (const auto length = exchange->parser.content_length(); length && *length > most_body_)
      return too_large(exchange);
    exchange->stream.expires_after(kBodyPatience);
    http::async_read(exchange->stream, exchange->buffer, exchange->parser,
                     [this, exchange](const Code& error, std::size_t) {
                       if (error == http::error::body_limit) return too_large(exchange);
                       if (!error) answer(exchange);
                     });
  }

  void answer(const Shared& exchange) {
    const auto& request = exchange->parser.get();
    if (request.method() == http::verb::get || !hooks_.is_slow(std::string(request.target())))
      return respond(exchange, answer_of(request));
    exchange->stream.expires_never();
    asio::post(worker_, [this, exchange] {
      asio::post(io_, [exchange, answer = answer_of(exchange->parser.get())]() mutable {
        respond(exchange, std::move(answer));
      });
    });
  }

  PageAnswer answer_of(const http::request<http::string_body>& request) const {
    const std::string target(request.target());
    try {
      return request.method() == http::verb::get ? hooks_.get(target)
                                                 : hooks_.post(target, request.body());
    } catch (const std::exception& error) {
      return {500, "text/plain; charset=utf-8", std::string(error.what()) + "\n"};
    }
  }

  std::string token_;
  std::size_t most_body_;
  PageHooks hooks_;
  asio::io_context io_{1};
  tcp::acceptor acceptor_;
  asio::signal_set signals_;
  asio::thread_pool worker_{1};
  std::deque<std::weak_ptr<Exchange>> open_;  ///< the oldest first
};

PageServer::PageServer(std::uint16_t port, std::string token, std::size_t most_body)
    : impl_(std::make_unique<Impl>(port, std::move(token), most_body)) {}
PageServer::~PageServer() = default;
std::uint16_t PageServer::port() const { return impl_->port(); }
void PageServer::run(PageHooks hooks) { impl_->run(std::move(hooks)); }

}  // namespace palpate::runner::serve
