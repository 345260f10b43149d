#include "runner/serve/loopback.h"

#include <sys/random.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string_view>

namespace palpate::runner::serve {

using boost::asio::ip::tcp;

void listen_on_loopback(tcp::acceptor& acceptor, std::uint16_t port) {
  try {
    const tcp::endpoint place(boost::asio::ip::address_v4::loopback(), port);
    acceptor.open(place.protocol());
    acceptor.set_option(tcp::acceptor::reuse_address(true));
    acceptor.bind(place);
    acceptor.listen();
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error("port " + std::to_string(port) +
                             " of 127.0.0.1: " + error.code().message() +
                             "; another server may run: --port 0 takes a free one");
  }
}

std::string make_token() {
  unsigned char bytes[16];
  if (::getrandom(bytes, sizeof bytes, 0) != sizeof bytes)
    throw std::runtime_error("the kernel gives no random numbers for a token");
  std::string out;
  for (const unsigned char byte : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    out += kDigits[byte >> 4];
    out += kDigits[byte & 15];
  }
  return out;
}

bool equal_in_constant_time(const std::string& said, const std::string& token) {
  std::size_t difference = said.size() ^ token.size();
  for (std::size_t i = 0; i < token.size(); ++i) {
    const char other = i < said.size() ? said[i] : '\0';
    difference |= static_cast<unsigned char>(token[i] ^ other);
  }
  return difference == 0;
}

bool is_loopback_name(std::string host) {
  const std::size_t colon = host.rfind(':');
  if (colon != std::string::npos) host.resize(colon);
  return host == "127.0.0.1" || host == "localhost";
}

GuardedPage guarded_page(std::string html, const std::string& connect) {
  const std::string nonce = make_token();
  constexpr std::string_view kMark = "@NONCE@";
  for (std::size_t at = 0; (at = html.find(kMark, at)) != std::string::npos;)
    html.replace(at, kMark.size(), nonce);
  return {std::move(html),
          {{"Content-Security-Policy",
            "default-src 'none'; script-src 'nonce-" + nonce + "'; style-src 'nonce-" + nonce +
                "'; img-src data:; connect-src " + connect +
                "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
           {"Cache-Control", "no-store"},
           {"Referrer-Policy", "no-referrer"},
           {"Cross-Origin-Opener-Policy", "same-origin"},
           {"Cross-Origin-Resource-Policy", "same-origin"}}};
}

}  // namespace palpate::runner::serve
