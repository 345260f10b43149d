#include "runner/participants/response_box.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace palpate::runner::participants {
namespace {

constexpr int kUsualBaud = 9600;
constexpr std::array<std::pair<int, speed_t>, 9> kSpeeds = {{{1200, B1200},
                                                             {2400, B2400},
                                                             {4800, B4800},
                                                             {9600, B9600},
                                                             {19200, B19200},
                                                             {38400, B38400},
                                                             {57600, B57600},
                                                             {115200, B115200},
                                                             {230400, B230400}}};

/// Path and speed of "PATH[:BAUD]".
std::pair<std::string, speed_t> port_of(const std::string& name) {
  const std::size_t colon = name.rfind(':');
  int baud = kUsualBaud;
  std::string path = name;
  const std::size_t digits = name.find_first_not_of("0123456789", colon + 1);
  if (colon != std::string::npos && colon + 1 < name.size() && digits == std::string::npos) {
    if (std::from_chars(name.data() + colon + 1, name.data() + name.size(), baud).ec != std::errc())
      baud = 0;
    path = name.substr(0, colon);
  }
  const auto* const speed = std::find_if(kSpeeds.begin(), kSpeeds.end(),
                                         [baud](const auto& one) { return one.first == baud; });
  if (path.empty() || speed == kSpeeds.end())
    throw std::invalid_argument("no serial port '" + name +
                                "'; expected PATH[:BAUD] with a usual speed, such as 9600");
  return {path, speed->second};
}

std::map<unsigned char, std::string> bytes_of(const std::map<std::string, std::string>& keys) {
  std::map<unsigned char, std::string> bytes;
  for (const auto& [input, key] : keys) {
    unsigned value = static_cast<unsigned char>(input[0]);
    if (input.size() == 4) std::from_chars(input.data() + 2, input.data() + 4, value, 16);
    bytes[static_cast<unsigned char>(value)] = key;
  }
  for (unsigned char c = '!'; keys.empty() && c <= '~'; ++c)
    bytes[c] = std::string(1, static_cast<char>(c));
  if (keys.empty()) bytes[' '] = "space";
  return bytes;
}

}  // namespace

ResponseBox::ResponseBox(const std::string& name, const std::map<std::string, std::string>& keys,
                         servo::Clock& clock, std::function<void()> emergency)
    : keys_(bytes_of(keys)), clock_(clock), emergency_(std::move(emergency)) {
  const std::pair<std::string, speed_t> port = port_of(name);
  const std::string& path = port.first;
  port_ = ::open(path.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  const auto refuse = [&](const std::string& why) {
    if (port_ >= 0) ::close(port_);
    throw std::runtime_error("the response box at " + path + ": " + why);
  };
  if (port_ < 0) refuse(std::strerror(errno));
  if (tcgetattr(port_, &before_) != 0) refuse("it is not a serial port");
  termios raw = before_;
  cfmakeraw(&raw);
  raw.c_cflag |= static_cast<tcflag_t>(CLOCAL | CREAD);
  cfsetispeed(&raw, port.second);
  cfsetospeed(&raw, port.second);
  if (tcsetattr(port_, TCSANOW, &raw) != 0) refuse(std::strerror(errno));
  tcflush(port_, TCIFLUSH);  // drop bytes sent before the start
  wake_ = eventfd(0, EFD_CLOEXEC);
  if (wake_ < 0) refuse(std::strerror(errno));
  thread_ = std::jthread([this] { listen(); });
}

ResponseBox::~ResponseBox() {
  eventfd_write(wake_, 1);
  thread_.join();
  tcsetattr(port_, TCSANOW, &before_);
  ::close(wake_);
  ::close(port_);
}

void ResponseBox::listen() noexcept {
  std::array<pollfd, 2> files = {{{wake_, POLLIN, 0}, {port_, POLLIN, 0}}};
  while (true) {
    if (poll(files.data(), files.size(), -1) < 0) {
      if (errno == EINTR) continue;
      break;
    }
    if (files[0].revents != 0) return;
    std::array<unsigned char, 64> bytes{};
    const ssize_t got = read(port_, bytes.data(), bytes.size());
    const std::int64_t now = clock_.now_ns();
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (got <= 0) break;
    for (ssize_t i = 0; i < got; ++i) {
      const auto key = keys_.find(bytes[static_cast<std::size_t>(i)]);
      if (key == keys_.end()) {
        const unsigned char byte = bytes[static_cast<std::size_t>(i)];
        int none = -1;
        if (byte != '\r' && byte != '\n') unknown_.compare_exchange_strong(none, byte);
        continue;
      }
      if (key->second == "escape") emergency_();
      presses_.add({key->second, now});
    }
  }
  failed_ = true;
}

std::optional<unsigned char> ResponseBox::unknown_byte() const {
  const int byte = unknown_.load();
  if (byte < 0) return std::nullopt;
  return static_cast<unsigned char>(byte);
}

std::string ScreenWithBox::trouble() const {
  if (box_.failed())
    return "the response box is unplugged: answer by keyboard; to use the box, plug it in and "
           "restart";
  std::string trouble = screen_.trouble();
  if (!trouble.empty()) return trouble;  // matters more than an unknown byte
  if (const auto byte = box_.unknown_byte()) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "the response box sent a byte that stands for no key (0x%02x): check its speed in "
        "--response-box and the bytes in the protocol's responses",
        static_cast<unsigned>(*byte));
    return text;
  }
  return {};
}

std::vector<display::KeyPress> ScreenWithBox::keys() {
  std::vector<display::KeyPress> keys = screen_.keys();
  const std::vector<display::KeyPress> more = box_.take();
  keys.insert(keys.end(), more.begin(), more.end());
  std::stable_sort(
      keys.begin(), keys.end(),
      [](const display::KeyPress& a, const display::KeyPress& b) { return a.time_ns < b.time_ns; });
  return keys;
}

}  // namespace palpate::runner::participants
