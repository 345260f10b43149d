#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <utility>

#include "runner/devices/haply/link.h"

namespace palpate::runner::devices::haply {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using Clock = std::chrono::steady_clock;
using Code = boost::system::error_code;

constexpr auto kPatience = std::chrono::seconds(2);
constexpr std::size_t kLongest = 1 << 20;  // bytes of a message

std::pair<std::string, std::string> host_and_port(const std::string& service) {
  const std::size_t colon = service.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == service.size())
    throw LinkError("'" + service + "' is not HOST:PORT of a service");
  return {service.substr(0, colon), service.substr(colon + 1)};
}

/// Runs a started operation to its end. \throws LinkError if it fails or takes too long
void finish(asio::io_context& io, const bool& done, const Code& error, const std::string& what) {
  const auto give_up = Clock::now() + kPatience;
  io.restart();
  while (!done && io.run_one_until(give_up) > 0) {
  }
  if (!done) throw LinkError(what + ": no answer in 2 s");
  if (error) throw LinkError(what + ": " + error.message());
}

void connect_to(asio::io_context& io, asio::ip::tcp::socket& socket, const std::string& service) {
  const auto [host, port] = host_and_port(service);
  Code error;
  asio::ip::tcp::resolver resolver(io);
  const auto places = resolver.resolve(host, port, error);
  if (error) throw LinkError("the address " + service + " is unknown: " + error.message());
  bool done = false;
  asio::async_connect(socket, places, [&](const Code& code, const auto&) {
    done = true;
    error = code;
  });
  finish(io, done, error, "no service answers at " + service);
  socket.set_option(asio::ip::tcp::no_delay(true), error);
}

class BeastLink final : public Link {
 public:
  explicit BeastLink(const std::string& service) : socket_(io_) {
    connect_to(io_, socket_.next_layer(), service);
    socket_.read_message_max(kLongest);
    bool done = false;
    Code error;
    socket_.async_handshake(service, "/", [&](const Code& code) {
      done = true;
      error = code;
    });
    finish(io_, done, error, "the service at " + service + " does not speak WebSocket");
    socket_.text(true);
  }

  bool receive(std::string_view& message, std::chrono::microseconds patience) override {
    if (!reading_) {
      buffer_.consume(buffer_.size());
      arrived_ = false;
      reading_ = true;
      socket_.async_read(buffer_, [this](const Code& code, std::size_t) {
        arrived_ = true;
        read_error_ = code;
      });
    }
    const auto give_up = Clock::now() + patience;
    io_.restart();
    while (!arrived_ && io_.run_one_until(give_up) > 0) {
    }
    if (!arrived_) return false;
    reading_ = false;
    if (read_error_)
      throw LinkError("the connection to the service has ended: " + read_error_.message());
    const auto bytes = buffer_.cdata();
    message = {static_cast<const char*>(bytes.data()), bytes.size()};
    return true;
  }

  void send(std::string_view message) override {
    bool done = false;
    Code error;
    socket_.async_write(asio::buffer(message.data(), message.size()),
                        [&](const Code& code, std::size_t) {
                          done = true;
                          error = code;
                        });
    finish(io_, done, error, "the connection to the service has ended");
  }

 private:
  asio::io_context io_{1};
  beast::websocket::stream<asio::ip::tcp::socket, false> socket_;
  beast::flat_buffer buffer_;
  bool reading_ = false, arrived_ = false;
  Code read_error_;
};

}  // namespace

std::unique_ptr<Link> connect(const std::string& service) {
  return std::make_unique<BeastLink>(service);
}

std::string get(const std::string& service, const std::string& target) {
  namespace http = beast::http;
  asio::io_context io{1};
  asio::ip::tcp::socket socket(io);
  connect_to(io, socket, service);
  http::request<http::empty_body> request{http::verb::get, target, 11};
  request.set(http::field::host, service);
  request.set(http::field::connection, "close");
  http::response_parser<http::string_body> reply;
  reply.body_limit(kLongest);
  beast::flat_buffer buffer;
  bool done = false;
  Code error;
  http::async_write(socket, request, [&](const Code& wrote, std::size_t) {
    if (wrote) {
      done = true;
      error = wrote;
      return;
    }
    http::async_read(socket, buffer, reply, [&](const Code& read, std::size_t) {
      done = true;
      error = read;
    });
  });
  finish(io, done, error, "no page " + target + " of " + service);
  return reply.get().result() == http::status::ok ? reply.get().body() : "";
}

}  // namespace palpate::runner::devices::haply
