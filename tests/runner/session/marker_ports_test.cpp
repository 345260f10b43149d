// Markers as pulses: on a serial port that is a pseudo-terminal, and on a parallel port whose ioctl
// is this program's.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/ppdev.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "runner/session/markers.h"

namespace {

using Clock = std::chrono::steady_clock;

struct Put {
  int byte;
  Clock::time_point at;
};

/// The commands to a parallel port. An empty file in /tmp stands for the port.
struct FakePort {
  std::mutex mutex;
  std::vector<unsigned long> requests;
  std::vector<Put> puts;
  bool refuses_claim = false, refuses_bytes = false;
};
FakePort* port = nullptr;

}  // namespace

extern "C" int ioctl(int file, unsigned long request, ...) noexcept {
  va_list list;
  va_start(list, request);
  void* const value = va_arg(list, void*);
  va_end(list);
  if (port == nullptr || _IOC_TYPE(request) != PP_IOCTL)
    return static_cast<int>(syscall(SYS_ioctl, file, request, value));
  const std::lock_guard lock(port->mutex);
  port->requests.push_back(request);
  if ((request == PPCLAIM && port->refuses_claim) || (request == PPWDATA && port->refuses_bytes)) {
    errno = EBUSY;
    return -1;
  }
  if (request == PPWDATA)
    port->puts.push_back({*static_cast<const unsigned char*>(value), Clock::now()});
  return 0;
}

namespace palpate::runner::session {
namespace {

using Kind = Marker::Kind;

Marker marker(Kind kind) {
  Marker one;
  one.kind = kind;
  one.code = code_of(one, protocols::usual_event_codes());
  return one;
}

class ParallelMarkers : public testing::Test {
 protected:
  void SetUp() override {
    const int file = mkstemp(path_.data());
    ASSERT_GE(file, 0);
    close(file);
    port = &fake_;
  }
  void TearDown() override {
    port = nullptr;
    unlink(path_.c_str());
  }
  std::vector<int> bytes() {
    const std::lock_guard lock(fake_.mutex);
    std::vector<int> out;
    for (const Put& put : fake_.puts) out.push_back(put.byte);
    return out;
  }

  std::string path_ = "/tmp/palpate-parport-XXXXXX";
  FakePort fake_;
};

TEST_F(ParallelMarkers, PulsesWaitForEachOther) {
  {
    const auto sink = open_marker_sink("parport:" + path_ + ":20", MarkerCodes::this_computer);
    for (const Kind kind : {Kind::trial_start, Kind::first_contact, Kind::response})
      EXPECT_TRUE(sink->send(marker(kind)));
  }
  // The lines are low before, between and after.
  EXPECT_EQ(bytes(), (std::vector<int>{0, 1, 0, 2, 0, 3, 0, 0}));
  constexpr std::chrono::milliseconds kWidth(20);
  for (std::size_t i = 1; i + 2 < fake_.puts.size(); ++i)
    EXPECT_GE(fake_.puts[i + 1].at - fake_.puts[i].at, kWidth) << i;
  EXPECT_EQ(fake_.requests.front(), static_cast<unsigned long>(PPCLAIM));
  EXPECT_EQ(fake_.requests.back(), static_cast<unsigned long>(PPRELEASE));
}

TEST_F(ParallelMarkers, SendingDoesNotWaitAndAFullQueueRefuses) {
  const auto begin = Clock::now();
  int taken = 0;
  Clock::time_point sent;
  {
    const auto sink = open_marker_sink("parport:" + path_ + ":100", MarkerCodes::this_computer);
    for (int i = 0; i < 40; ++i) taken += sink->send(marker(Kind::response));
    sent = Clock::now();
  }
  // All accepted markers were sent; no pulse delayed the sender.
  EXPECT_GE(taken, 16);
  EXPECT_LE(taken, 17);
  EXPECT_EQ(std::ssize(bytes()), 2 * taken + 2);
  EXPECT_LT((sent - begin) * 4, Clock::now() - begin);
}

TEST_F(ParallelMarkers, AFailingPortIsReported) {
  fake_.refuses_claim = true;
  EXPECT_THROW(open_marker_sink("parport:" + path_, MarkerCodes::this_computer),
               std::runtime_error);
  fake_.refuses_claim = false;
  const auto sink = open_marker_sink("parport:" + path_ + ":1", MarkerCodes::this_computer);
  {
    const std::lock_guard lock(fake_.mutex);
    fake_.refuses_bytes = true;
  }
  EXPECT_TRUE(sink->send(marker(Kind::response)));  // the failure is not known yet
  const auto asked = [&] {
    const std::lock_guard lock(fake_.mutex);
    return fake_.requests.size();
  };
  while (asked() < 5) usleep(1000);  // a failed claim; claim, 0; the pulse up and down
  bool told = false;
  for (int i = 0; i < 10 && !told; ++i) {
    usleep(5000);
    told = !sink->send(marker(Kind::response));
  }
  EXPECT_TRUE(told);
}

TEST_F(ParallelMarkers, AProtocolsOwnCodesAreSent) {
  {
    std::vector<std::unique_ptr<MarkerSink>> sinks;
    sinks.push_back(open_marker_sink("parport:" + path_ + ":1", MarkerCodes::this_computer));
    protocols::EventCodes codes = protocols::usual_event_codes();
    codes["trial_start"] = 10;
    codes["response:cube"] = 255;
    Markers markers(std::move(sinks), codes);
    Marker one;
    markers.send(one);
    one.kind = Kind::response;
    for (const char* answer : {"cube", "ball", ""}) {
      one.response = answer;
      markers.send(one);
    }
    one.kind = Kind::cut_off;  // its answer belongs to an earlier one
    one.response = "cube";
    markers.send(one);
  }
  EXPECT_EQ(bytes(), (std::vector<int>{0, 10, 0, 255, 0, 3, 0, 3, 0, 5, 0, 0}));
}

TEST_F(ParallelMarkers, SyncMarkersKeepInStepWithTheSeconds) {
  {
    std::vector<std::unique_ptr<MarkerSink>> sinks;
    sinks.push_back(open_marker_sink("parport:" + path_ + ":1", MarkerCodes::this_computer));
    Markers markers(std::move(sinks), protocols::usual_event_codes(), true);
    const auto seconds = [this] {
      const std::vector<int> all = bytes();
      return std::count(all.begin(), all.end(), 128);
    };
    while (seconds() < 2) usleep(1000);
    markers.send(marker(Kind::response));
    while (seconds() < 3) usleep(1000);
  }
  EXPECT_EQ(bytes(), (std::vector<int>{0, 128, 0, 128, 0, 3, 0, 128, 0, 0}));
  // Never early; lateness depends on the computer.
  EXPECT_GT(fake_.puts[7].at - fake_.puts[1].at, std::chrono::milliseconds(1500));
}

TEST(MarkerPorts, RefusesOtherFiles) {
  for (const char* name :
       {"parport:", "parport:/dev/null", "parport:/no/such", "serial:/dev/null",
        "parport:/dev/null:0", "parport:/dev/null:101", "serial:/dev/null:9600:0",
        "serial:/dev/null:77", "udp:here", "udp::9", "udp:here:0", "usb:1", ""})
    EXPECT_ANY_THROW(open_marker_sink(name, MarkerCodes::this_computer)) << name;
}

TEST(MarkerPorts, ASerialPortGetsBytesOrPulses) {
  int master = -1, slave = -1;
  std::string name(100, '\0');
  ASSERT_EQ(openpty(&master, &slave, name.data(), nullptr, nullptr), 0);
  const std::string path = name.c_str();
  const auto read_bytes = [&](std::size_t count) {
    std::string got;
    pollfd ready{master, POLLIN, 0};
    constexpr int kPatience = 10'000;  // ms until a missing byte counts as lost
    while (got.size() < count && poll(&ready, 1, kPatience) == 1) {
      std::string some(count - got.size(), '\0');
      const ssize_t n = read(master, some.data(), some.size());
      if (n <= 0) break;
      got += some.substr(0, static_cast<std::size_t>(n));
    }
    return got;
  };
  for (const std::string rate : {"", ":115200"}) {
    const auto sink = open_marker_sink("serial:" + path + rate, MarkerCodes::this_computer);
    EXPECT_TRUE(sink->send(marker(Kind::trial_start)));
    EXPECT_TRUE(sink->send(marker(Kind::time_out)));
    EXPECT_EQ(read_bytes(2), std::string("\1\4"));
  }
  const auto sink = open_marker_sink("serial:" + path + ":9600:5", MarkerCodes::this_computer);
  EXPECT_TRUE(sink->send(marker(Kind::response)));
  EXPECT_TRUE(sink->send(marker(Kind::cut_off)));
  EXPECT_EQ(read_bytes(4), std::string("\3\0\5\0", 4));
  close(master);
  close(slave);
}

}  // namespace
}  // namespace palpate::runner::session
