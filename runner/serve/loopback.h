#pragma once
// Common part of servers of pages on this computer: they listen on 127.0.0.1 alone, and no
// page of another origin reaches them.

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace palpate::runner::serve {

/// \throws std::runtime_error naming the port
void listen_on_loopback(boost::asio::ip::tcp::acceptor& acceptor, std::uint16_t port);

/// 128 bits as 32 hexadecimal digits, from the kernel. \throws std::runtime_error
std::string make_token();

/// Compares in constant time, so that timing does not reveal the token.
bool equal_in_constant_time(const std::string& said, const std::string& token);

/// Whether a Host header names this computer, not a foreign name that resolves to it.
bool is_loopback_name(std::string host);

struct GuardedPage {
  std::string html;
  std::vector<std::pair<std::string, std::string>> headers;  ///< names and values
};

/// A page that runs its own scripts and styles only, and loads nothing from elsewhere.
/// \param html  its script and style elements have the nonce @NONCE@
/// \param connect  sources that its scripts may connect to, as in a content security policy
GuardedPage guarded_page(std::string html, const std::string& connect);

}  // namespace palpate::runner::serve
