// A response box at the other end of a pseudo-terminal.

#include "runner/participants/response_box.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "runner/servo/realtime.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::participants {
namespace {

using Mapping = std::map<std::string, std::string>;

class PseudoTerminal {
 public:
  PseudoTerminal() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0)
      throw std::runtime_error("no pseudo-terminal");
    path = ptsname(master_);
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;
  ~PseudoTerminal() { hang_up(); }
  void send(const std::string& bytes) const {
    ASSERT_EQ(write(master_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  void hang_up() {
    if (master_ >= 0) close(master_);
    master_ = -1;
  }
  std::string path;

 private:
  int master_;
};

template <class Condition>
bool comes(const Condition& condition) {
  for (int i = 0; i < 2000 && !condition(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return condition();
}

class Box : public ::testing::Test {
 protected:
  std::string keys_after(const std::string& bytes, const Mapping& mapping, std::size_t count) {
    ResponseBox box(terminal_.path, mapping, clock_, [this] { ++emergencies_; });
    const std::int64_t before = clock_.now_ns();
    terminal_.send(bytes);
    std::vector<display::KeyPress> all;
    comes([&] {
      for (const display::KeyPress& press : box.take()) all.push_back(press);
      return all.size() >= count;
    });
    std::string keys;
    for (const display::KeyPress& press : all) {
      keys += press.key + " ";
      EXPECT_GE(press.time_ns, before);
      EXPECT_LE(press.time_ns, clock_.now_ns());
    }
    return keys;
  }

  servo::RealClock clock_;
  PseudoTerminal terminal_;
  std::atomic<int> emergencies_{0};
};

TEST_F(Box, CharactersStandForThemselvesWithoutAMapping) {
  EXPECT_EQ(keys_after("12 a\r\n", {}, 4), "1 2 space a ");
}

TEST_F(Box, OnlyMappedBytesAreKeys) {
  EXPECT_EQ(
      keys_after(std::string("1A\x05\0", 4), {{"A", "1"}, {"0x05", "space"}, {"0x00", "2"}}, 3),
      "1 space 2 ");
}

TEST_F(Box, EscapeIsAnImmediateEmergency) {
  EXPECT_EQ(keys_after("E", {{"E", "escape"}}, 1), "escape ");
  EXPECT_EQ(emergencies_, 1);
}

TEST_F(Box, AnUnpluggedBoxIsReportedAndTheKeyboardStays) {
  ResponseBox box(terminal_.path, {}, clock_, [] {});
  class Keyboard final : public display::ParticipantScreen {
   public:
    void show(const display::Page&) override {}
    std::vector<display::KeyPress> keys() override { return {{"k", 1}}; }
    bool open() const override { return true; }
  } keyboard;
  ScreenWithBox screen(keyboard, box);
  EXPECT_EQ(screen.trouble(), "");
  terminal_.hang_up();
  EXPECT_TRUE(comes([&] { return !screen.trouble().empty(); }));
  ASSERT_EQ(screen.keys().size(), 1U);
  EXPECT_EQ(screen.keys().front().key, "k");
}

// As with a box at another speed, whose bytes arrive changed.
TEST_F(Box, AnUnknownByteIsReported) {
  ResponseBox box(terminal_.path, {{"A", "1"}}, clock_, [] {});
  class Keyboard final : public display::ParticipantScreen {
   public:
    void show(const display::Page&) override {}
    std::vector<display::KeyPress> keys() override { return {}; }
    bool open() const override { return true; }
  } keyboard;
  ScreenWithBox screen(keyboard, box);
  terminal_.send("A\r\nA");
  std::size_t known = 0;
  EXPECT_TRUE(comes([&] { return (known += screen.keys().size()) == 2; }));
  EXPECT_EQ(screen.trouble(), "");
  terminal_.send("\xf3Q");
  EXPECT_TRUE(comes([&] { return !screen.trouble().empty(); }));
  EXPECT_NE(screen.trouble().find("0xf3"), std::string::npos) << screen.trouble();
}

// udev's names of ports by their places have colons.
TEST_F(Box, APathMayHaveColons) {
  const palpate::testing::TemporaryFolder folder;
  const std::string path = folder / "pci-0000:00:14.0-usb-0:2:1.0-port0";
  ASSERT_EQ(symlink(terminal_.path.c_str(), path.c_str()), 0);
  EXPECT_NO_THROW(ResponseBox(path, {}, clock_, [] {}));
  EXPECT_NO_THROW(ResponseBox(path + ":19200", {}, clock_, [] {}));
}

TEST_F(Box, RefusesOtherFiles) {
  EXPECT_THROW(ResponseBox("/dev/null", {}, clock_, [] {}), std::runtime_error);
  EXPECT_THROW(ResponseBox("/no/such", {}, clock_, [] {}), std::runtime_error);
  EXPECT_THROW(ResponseBox(terminal_.path + ":123", {}, clock_, [] {}), std::invalid_argument);
  EXPECT_THROW(ResponseBox(terminal_.path + ":99999999999", {}, clock_, [] {}),
               std::invalid_argument);
  EXPECT_THROW(ResponseBox(terminal_.path + ":x", {}, clock_, [] {}), std::runtime_error);
  EXPECT_THROW(ResponseBox(":9600", {}, clock_, [] {}), std::invalid_argument);
  EXPECT_NO_THROW(ResponseBox(terminal_.path + ":115200", {}, clock_, [] {}));
}

}  // namespace
}  // namespace palpate::runner::participants
