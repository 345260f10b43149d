// Where markers go: UDP, serial and parallel port, and Lab Streaming Layer where liblsl is
// installed.

#include <fcntl.h>
#include <linux/ppdev.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "runner/servo/realtime.h"
#include "runner/session/lsl_library.h"
#include "runner/session/markers.h"

namespace palpate::runner::session {
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
  servo::RealClock clock;
  return clock.now_ns();
}

/// Whether data sent through a connected socket stays on this computer: the peer is the loopback or
/// the socket's own address.
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
      // A refusal is reported at the next send, whose line is then lost: send it again.
      if (give(line)) return true;
      give(line);
    } catch (...) {  // out of memory
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

/// A port that takes bytes.
class BytePort {
 public:
  virtual ~BytePort() = default;
  /// False: the byte was not taken. Must not wait.
  virtual bool put(unsigned char byte) noexcept = 0;
};

/// A serial port, 8N1.
class SerialPort final : public BytePort {
 public:
  SerialPort(const std::string& path, int baud)
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

  bool put(unsigned char byte) noexcept override { return write(port_.get(), &byte, 1) == 1; }

 private:
  File port_;
};

/// The data lines of a parallel port, by Linux's ppdev.
class ParallelPort final : public BytePort {
 public:
  explicit ParallelPort(const std::string& path) : port_(open(path.c_str(), O_RDWR | O_CLOEXEC)) {
    if (port_.get() < 0) fail("parport:" + path, std::strerror(errno));
    if (ioctl(port_.get(), PPCLAIM) != 0)
      fail("parport:" + path, errno == ENOTTY ? "this is no parallel port" : std::strerror(errno));
    if (!put(0)) fail("parport:" + path, std::strerror(errno));
  }
  ParallelPort(const ParallelPort&) = delete;
  ParallelPort& operator=(const ParallelPort&) = delete;
  ~ParallelPort() override {
    put(0);
    ioctl(port_.get(), PPRELEASE);
  }

  bool put(unsigned char byte) noexcept override { return ioctl(port_.get(), PPWDATA, &byte) == 0; }

 private:
  File port_;
};

/// Writes one byte for each marker.
class ByteSink final : public MarkerSink {
 public:
  explicit ByteSink(std::unique_ptr<BytePort> port) : port_(std::move(port)) {}
  bool send(const Marker& marker) noexcept override {
    return port_->put(static_cast<unsigned char>(marker.code));
  }

 private:
  std::unique_ptr<BytePort> port_;
};

/// Writes a pulse for each marker: its byte, then 0 after the width. A recorder that samples the
/// lines must see each pulse, so the next one begins one width after the last ended. Uses a thread
/// of its own.
class PulseSink final : public MarkerSink {
 public:
  PulseSink(std::unique_ptr<BytePort> port, std::chrono::milliseconds width)
      : port_(std::move(port)), width_(width), thread_([this] { work(); }) {}
  PulseSink(const PulseSink&) = delete;
  PulseSink& operator=(const PulseSink&) = delete;
  /// Writes the waiting pulses.
  ~PulseSink() override {
    {
      const std::lock_guard lock(mutex_);
      quit_ = true;
    }
    came_.notify_one();
  }

  bool send(const Marker& marker) noexcept override {
    constexpr std::size_t kMostPulses = 16;
    try {
      const std::lock_guard lock(mutex_);
      // A byte that the port did not take is reported with the next marker.
      if (waiting_.size() >= kMostPulses || std::exchange(failed_, false)) return false;
      waiting_.push_back(static_cast<unsigned char>(marker.code));
    } catch (...) {  // out of memory
      return false;
    }
    came_.notify_one();
    return true;
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      came_.wait(lock, [this] { return quit_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      const unsigned char byte = waiting_.front();
      waiting_.pop_front();
      lock.unlock();
      const bool up = port_->put(byte);
      std::this_thread::sleep_for(width_);
      const bool down = port_->put(0);
      std::this_thread::sleep_for(width_);
      lock.lock();
      failed_ = failed_ || !up || !down;
    }
  }

  std::unique_ptr<BytePort> port_;
  const std::chrono::milliseconds width_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<unsigned char> waiting_;
  bool quit_ = false, failed_ = false;
  std::jthread thread_;  ///< the last member: it uses the others
};

/// Lab Streaming Layer: a stream of type Markers, irregular, one JSON text each, stamped with the
/// event's own time. liblsl's clock is CLOCK_MONOTONIC in seconds on Linux, but may be built
/// otherwise, so the event's age is passed. Anyone on the network may listen.
class LslSink final : public MarkerSink {
 public:
  LslSink(const std::string& name, MarkerCodes codes)
      : with_code_(codes == MarkerCodes::everywhere), library_("markers to lsl") {
    library_.find(create_info_, "lsl_create_streaminfo");
    library_.find(create_outlet_, "lsl_create_outlet");
    library_.find(push_, "lsl_push_sample_strt");
    library_.find(clock_, "lsl_local_clock");
    library_.find(destroy_outlet_, "lsl_destroy_outlet");
    library_.find(destroy_info_, "lsl_destroy_streaminfo");
    constexpr int kString = 3;  // cft_string
    info_ = create_info_(name.c_str(), "Markers", 1, 0.0, kString, ("palpate-" + name).c_str());
    if (info_ != nullptr) outlet_ = create_outlet_(info_, 0, 360);
    if (outlet_ == nullptr) library_.fail("liblsl gave no stream");
  }
  LslSink(const LslSink&) = delete;
  LslSink& operator=(const LslSink&) = delete;
  ~LslSink() override {
    destroy_outlet_(outlet_);
    destroy_info_(info_);
  }

  bool send(const Marker& marker) noexcept override {
    try {
      const std::int64_t now = now_ns();
      std::string line = to_json_line(marker, now, with_code_);
      line.pop_back();
      const char* sample = line.c_str();
      const double age = static_cast<double>(now - marker.time_ns) * 1e-9;
      return push_(outlet_, &sample, clock_() - age) == 0;
    } catch (...) {  // out of memory
      return false;
    }
  }

 private:
  const bool with_code_;
  const LslLibrary library_;
  void* (*create_info_)(const char*, const char*, std::int32_t, double, int, const char*) = nullptr;
  void* (*create_outlet_)(void*, std::int32_t, std::int32_t) = nullptr;
  std::int32_t (*push_)(void*, const char**, double) = nullptr;
  double (*clock_)() = nullptr;
  void (*destroy_outlet_)(void*) = nullptr;
  void (*destroy_info_)(void*) = nullptr;
  void* info_ = nullptr;
  void* outlet_ = nullptr;
};

constexpr const char* kExpected =
    "expected udp:HOST:PORT, serial:PATH[:BAUD[:PULSE_MS]], parport:PATH[:PULSE_MS] or lsl[:NAME]";

[[noreturn]] void refuse(const std::string& name) {
  throw std::invalid_argument("no markers to '" + name + "'; " + kExpected);
}

/// Removes ":NUMBER" from the end of a text and returns the number. None: the text has no such end.
std::optional<int> number_at_end(std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  int number = 0;
  const char* const stop = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data() + colon + 1, stop, number);
  if (colon + 1 == text.size() || error != std::errc() || end != stop) return std::nullopt;
  text.resize(colon);
  return number;
}

std::chrono::milliseconds pulse_width(const std::string& name, int milliseconds) {
  constexpr int kLongest = 100;
  if (milliseconds < 1 || milliseconds > kLongest)
    throw std::invalid_argument("markers to '" + name + "': a pulse has 1 to 100 ms, not " +
                                std::to_string(milliseconds));
  return std::chrono::milliseconds(milliseconds);
}

std::unique_ptr<MarkerSink> serial_sink(const std::string& name, std::string path) {
  constexpr int kBaud = 9600;
  const std::optional<int> last = number_at_end(path);
  const std::optional<int> before = last ? number_at_end(path) : std::nullopt;
  const int baud = before.value_or(last.value_or(kBaud));
  if (!before) return std::make_unique<ByteSink>(std::make_unique<SerialPort>(path, baud));
  const std::chrono::milliseconds width = pulse_width(name, *last);
  return std::make_unique<PulseSink>(std::make_unique<SerialPort>(path, baud), width);
}

std::unique_ptr<MarkerSink> parallel_sink(const std::string& name, std::string path) {
  constexpr int kPulse = 5;  // ms: five samples of an amplifier at 1 kHz
  const std::chrono::milliseconds width = pulse_width(name, number_at_end(path).value_or(kPulse));
  return std::make_unique<PulseSink>(std::make_unique<ParallelPort>(path), width);
}

}  // namespace

std::unique_ptr<MarkerSink> open_marker_sink(const std::string& name, MarkerCodes codes) {
  const std::size_t colon = name.find(':');
  const std::string kind = name.substr(0, colon);
  std::string rest = colon == std::string::npos ? "" : name.substr(colon + 1);
  if (kind == "lsl") return std::make_unique<LslSink>(rest.empty() ? "palpate" : rest, codes);
  if (kind == "serial" && !rest.empty()) return serial_sink(name, rest);
  if (kind == "parport" && !rest.empty()) return parallel_sink(name, rest);
  if (kind == "udp") {
    const std::optional<int> port = number_at_end(rest);
    if (port && *port > 0 && *port < 65536 && !rest.empty())
      return std::make_unique<UdpSink>(rest, std::to_string(*port), codes);
  }
  refuse(name);
}

}  // namespace palpate::runner::session
