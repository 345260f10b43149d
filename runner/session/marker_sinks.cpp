// UDP, serial port, and Lab Streaming Layer where liblsl is installed.

#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "runner/servo/realtime.h"
#include "runner/session/markers.h"

namespace palpate::runner {
namespace {

class File {
 public:
  explicit File(int file) : file_(file) {}
  File(File&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  File& operator=(File&&) = delete;
  ~File() {
    if (file_ >= 0) close(file_);
  }
  int get() const { return file_; }

 private:
  int file_;
};

[[noreturn]] void fail(const std::string& what, const std::string& why) {
  throw std::runtime_error("markers to " + what + ": " + why);
}

std::int64_t now_ns() {
  RealClock clock;
  return clock.now_ns();
}

/// Whether what is sent through a connected socket does not leave this computer: it goes to the
/// loop back, or to the very address that it comes from.
bool stays_here(int file) {
  sockaddr_storage here{}, there{};
  socklen_t here_size = sizeof here, there_size = sizeof there;
  if (getsockname(file, reinterpret_cast<sockaddr*>(&here), &here_size) != 0 ||
      getpeername(file, reinterpret_cast<sockaddr*>(&there), &there_size) != 0) {
    return false;
  }
  constexpr std::uint32_t kLoopbackNet = 127;
  if (there.ss_family == AF_INET) {
    sockaddr_in from{}, to{};
    std::memcpy(&from, &here, sizeof from);
    std::memcpy(&to, &there, sizeof to);
    return ntohl(to.sin_addr.s_addr) >> 24 == kLoopbackNet ||
           from.sin_addr.s_addr == to.sin_addr.s_addr;
  }
  if (there.ss_family != AF_INET6) return false;
  sockaddr_in6 from{}, to{};
  std::memcpy(&from, &here, sizeof from);
  std::memcpy(&to, &there, sizeof to);
  return IN6_IS_ADDR_LOOPBACK(&to.sin6_addr) || IN6_ARE_ADDR_EQUAL(&from.sin6_addr, &to.sin6_addr);
}

class UdpSink final : public MarkerSink {
 public:
  UdpSink(const std::string& host, const std::string& port, MarkerCodes codes)
      : socket_(connected(host, port)),
        with_code_(codes == MarkerCodes::everywhere || stays_here(socket_.get())) {}

  bool send(const Marker& marker) noexcept override {
    try {
      const std::string line = to_json_line(marker, now_ns(), with_code_);
      // A refusal is reported when the next line is sent, which then was not: once more.
      if (give(line)) return true;
      give(line);
    } catch (...) {  // no memory
    }
    return false;
  }

 private:
  bool give(const std::string& line) noexcept {
    return ::send(socket_.get(), line.data(), line.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
  }
  static int connected(const std::string& host, const std::string& port) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    const std::string name = "udp:" + host + ":" + port;
    if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found))
      fail(name, gai_strerror(error));
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, freeaddrinfo);
    for (const addrinfo* at = found; at != nullptr; at = at->ai_next) {
      const int file = socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol);
      if (file < 0) continue;
      if (connect(file, at->ai_addr, at->ai_addrlen) == 0) return file;
      close(file);
    }
    fail(name, std::strerror(errno));
  }

  File socket_;
  const bool with_code_;
};

speed_t speed_of(int baud) {
  static const std::map<int, speed_t> known = {
      {1200, B1200},   {2400, B2400},   {4800, B4800},     {9600, B9600},    {19200, B19200},
      {38400, B38400}, {57600, B57600}, {115200, B115200}, {230400, B230400}};
  const auto speed = known.find(baud);
  if (speed == known.end())
    throw std::invalid_argument("a serial port has no speed of " + std::to_string(baud) + " baud");
  return speed->second;
}

/// One byte for each marker, 8N1.
class SerialSink final : public MarkerSink {
 public:
  SerialSink(const std::string& path, int baud)
      : port_(open(path.c_str(), O_WRONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    const speed_t speed = speed_of(baud);
    if (port_.get() < 0) fail("serial:" + path, std::strerror(errno));
    termios settings{};
    if (tcgetattr(port_.get(), &settings) != 0) fail("serial:" + path, "this is no serial port");
    cfmakeraw(&settings);
    settings.c_cflag |= static_cast<tcflag_t>(CLOCAL);
    cfsetispeed(&settings, speed);
    cfsetospeed(&settings, speed);
    if (tcsetattr(port_.get(), TCSANOW, &settings) != 0)
      fail("serial:" + path, std::strerror(errno));
  }

  bool send(const Marker& marker) noexcept override {
    const auto byte = static_cast<unsigned char>(marker.kind);
    return write(port_.get(), &byte, 1) == 1;
  }

 private:
  File port_;
};

/// Lab Streaming Layer: a stream of type Markers, irregular, one JSON text each, stamped with the
/// event's own time. liblsl's clock is CLOCK_MONOTONIC in seconds on Linux, but may be built
/// otherwise: the event's age is what is handed over. Whoever is on the network may listen.
class LslSink final : public MarkerSink {
 public:
  LslSink(const std::string& name, MarkerCodes codes)
      : with_code_(codes == MarkerCodes::everywhere) {
    for (const char* library : {"liblsl.so.2", "liblsl.so", "liblsl.so.1"}) {
      library_ = dlopen(library, RTLD_NOW | RTLD_LOCAL);
      if (library_ != nullptr) break;
    }
    if (library_ == nullptr) fail("lsl", "liblsl is not installed (liblsl.so was not found)");
    find(create_info_, "lsl_create_streaminfo");
    find(create_outlet_, "lsl_create_outlet");
    find(push_, "lsl_push_sample_strt");
    find(clock_, "lsl_local_clock");
    find(destroy_outlet_, "lsl_destroy_outlet");
    find(destroy_info_, "lsl_destroy_streaminfo");
    constexpr int kString = 3;  // cft_string
    info_ = create_info_(name.c_str(), "Markers", 1, 0.0, kString, ("palpate-" + name).c_str());
    if (info_ != nullptr) outlet_ = create_outlet_(info_, 0, 360);
    if (outlet_ == nullptr) fail("lsl", "liblsl gave no stream");
  }
  LslSink(const LslSink&) = delete;
  LslSink& operator=(const LslSink&) = delete;
  ~LslSink() override {
    destroy_outlet_(outlet_);
    destroy_info_(info_);  // the library stays: it has threads of its own
  }

  bool send(const Marker& marker) noexcept override {
    try {
      const std::int64_t now = now_ns();
      std::string line = to_json_line(marker, now, with_code_);
      line.pop_back();
      const char* sample = line.c_str();
      const double age = static_cast<double>(now - marker.time_ns) * 1e-9;
      return push_(outlet_, &sample, clock_() - age) == 0;
    } catch (...) {  // no memory
      return false;
    }
  }

 private:
  template <class Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(dlsym(library_, name));
    if (function == nullptr) fail("lsl", std::string("liblsl has no ") + name);
  }

  const bool with_code_;
  void* library_ = nullptr;
  void* (*create_info_)(const char*, const char*, std::int32_t, double, int, const char*) = nullptr;
  void* (*create_outlet_)(void*, std::int32_t, std::int32_t) = nullptr;
  std::int32_t (*push_)(void*, const char**, double) = nullptr;
  double (*clock_)() = nullptr;
  void (*destroy_outlet_)(void*) = nullptr;
  void (*destroy_info_)(void*) = nullptr;
  void* info_ = nullptr;
  void* outlet_ = nullptr;
};

[[noreturn]] void refuse(const std::string& name) {
  throw std::invalid_argument("no markers to '" + name +
                              "'; expected udp:HOST:PORT, serial:PATH[:BAUD] or lsl[:NAME]");
}

}  // namespace

std::unique_ptr<MarkerSink> open_marker_sink(const std::string& name, MarkerCodes codes) {
  const std::size_t colon = name.find(':');
  const std::string kind = name.substr(0, colon);
  const std::string rest = colon == std::string::npos ? "" : name.substr(colon + 1);
  if (kind == "lsl") return std::make_unique<LslSink>(rest.empty() ? "palpate" : rest, codes);
  const std::size_t last = rest.rfind(':');
  const std::string before = rest.substr(0, last);
  const std::string after = last == std::string::npos ? "" : rest.substr(last + 1);
  int number = 0;
  const auto [end, error] = std::from_chars(after.data(), after.data() + after.size(), number);
  const bool numbered =
      !after.empty() && error == std::errc() && end == after.data() + after.size();
  if (kind == "udp" && numbered && number > 0 && number < 65536 && !before.empty())
    return std::make_unique<UdpSink>(before, after, codes);
  if (kind == "serial" && numbered && !before.empty())
    return std::make_unique<SerialSink>(before, number);
  if (kind == "serial" && !rest.empty()) return std::make_unique<SerialSink>(rest, 9600);
  refuse(name);
}

}  // namespace palpate::runner
