#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "protocols/parse.h"
#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/packets.h"
#include "tests/runner/devices/falcon/emulator.h"
#include "tests/runner/devices/falcon/fake_transport.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::devices::falcon {
namespace {

using testing::Emulator;
using testing::FakeTransport;
using testing::synthetic_image;

struct Bench {
  Emulator emulator;
  FakeTransport line{emulator};
  FirmwareImage image = parse_image(synthetic_image(600), "made up");
  std::vector<BootProgress> reports;

  void run(const FirmwareImage* with) {
    boot(line, with, {}, [this](const BootProgress& progress) { reports.push_back(progress); });
  }
  std::string failure(const FirmwareImage* with) {
    try {
      run(with);
    } catch (const TransportError& error) {
      return error.what();
    }
    return "";
  }
};

/// Answers everything with the same bytes.
class Parrot final : public Transport {
 public:
  explicit Parrot(Packet answer) : answer_(answer) {}
  const std::string& serial() const override { return serial_; }
  void control(std::uint8_t /*request*/, std::uint16_t /*value*/) override { place_ = kSilent; }
  void reopen() override {}
  bool send(std::span<const std::uint8_t> /*bytes*/) noexcept override {
    place_ = 0;
    return true;
  }
  std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) noexcept override {
    std::size_t count = 0;
    while (count < bytes.size() && place_ < answer_.size()) bytes[count++] = answer_[place_++];
    if (count == 0) now_ += wait_ns;
    return count;
  }
  bool drain(std::int64_t /*wait_ns*/) noexcept override { return true; }
  bool gone() const noexcept override { return false; }
  std::int64_t now_ns() noexcept override { return now_; }

 private:
  static constexpr std::size_t kSilent = 1000;
  std::string serial_ = "PARROT";
  Packet answer_;
  std::size_t place_ = kSilent;
  std::int64_t now_ = 0;
};

// Only the firmware sends valid replies; bytes merely framed like one may be anything on that line.
TEST(FalconBoot, OnlyAValidReplyShowsRunningFirmware) {
  Packet reply = encode(Reply{{1, -2, 3}, 0, 7});
  Parrot firmware(reply);
  EXPECT_TRUE(firmware_runs(firmware, {}));
  reply[5] = '!';  // no digit
  Parrot other(reply);
  EXPECT_FALSE(firmware_runs(other, {}));
}

TEST(FalconBoot, UploadsTheImageToABareDevice) {
  Bench bench;
  bench.run(&bench.image);
  EXPECT_EQ(bench.emulator.mode(), Emulator::Mode::run);
  EXPECT_EQ(bench.emulator.image(), bench.image.bytes);
  EXPECT_EQ(bench.emulator.uploads(), 1);
  EXPECT_EQ(bench.emulator.latency_ms(), 1);
  EXPECT_EQ(bench.reports.back().step, BootProgress::Step::running);
  EXPECT_EQ(bench.reports.back().attempt, 1);
  EXPECT_EQ(bench.emulator.largest_count(), 0);
}

TEST(FalconBoot, DoesNotUploadWhenFirmwareIsRunning) {
  Bench bench;
  bench.emulator.preload(true);
  bench.run(nullptr);
  EXPECT_EQ(bench.emulator.uploads(), 0);
  EXPECT_EQ(bench.emulator.homed(), 7U);
}

TEST(FalconBoot, ReportsProgressInBytes) {
  Bench bench;
  bench.run(&bench.image);
  std::size_t sent = 0;
  for (const BootProgress& report : bench.reports) {
    if (report.step != BootProgress::Step::uploading) continue;
    EXPECT_GT(report.sent, sent);
    EXPECT_EQ(report.size, bench.image.bytes.size());
    sent = report.sent;
  }
  EXPECT_EQ(sent, bench.image.bytes.size());
}

TEST(FalconBoot, RetriesAfterLostAndWrongEchoes) {
  Bench bench;
  bench.emulator.faults.lost_echoes = 2;
  bench.emulator.faults.wrong_echoes = 2;
  bench.run(&bench.image);
  EXPECT_EQ(bench.emulator.uploads(), 5);
  EXPECT_EQ(bench.line.reopened, 4);
  EXPECT_EQ(bench.emulator.image(), bench.image.bytes);
  EXPECT_EQ(bench.emulator.mode(), Emulator::Mode::run);
}

TEST(FalconBoot, ToleratesExtraBytesAndASlowMonitor) {
  Bench bench;
  bench.emulator.faults.stray_byte = true;
  bench.emulator.faults.deaf_probes = 30;
  bench.run(&bench.image);
  EXPECT_EQ(bench.emulator.uploads(), 1);
}

TEST(FalconBoot, GivesUpWithTheReasonOfEveryAttempt) {
  Bench bench;
  bench.emulator.faults.wrong_echoes = 1000;
  const std::string failure = bench.failure(&bench.image);
  EXPECT_NE(failure.find("10 attempts"), std::string::npos) << failure;
  EXPECT_NE(failure.find("attempt 10: a wrong echo at byte 149"), std::string::npos) << failure;
  EXPECT_EQ(bench.emulator.uploads(), 10);
}

TEST(FalconBoot, AnUnpluggedDeviceIsNamed) {
  Bench bench;
  bench.line.unplugged = true;
  EXPECT_FALSE(bench.failure(&bench.image).empty());
}

TEST(FalconBoot, WithoutAFirmwareFileTheErrorNamesTheOption) {
  Bench bench;
  const std::string failure = bench.failure(nullptr);
  EXPECT_NE(failure.find("--firmware"), std::string::npos) << failure;
  EXPECT_EQ(bench.emulator.uploads(), 0);
}

std::string refusal(std::vector<std::uint8_t> bytes) {
  try {
    parse_image(std::move(bytes), "f.bin");
  } catch (const protocols::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(FalconImage, AcceptsAWellFormedStream) {
  const FirmwareImage image = parse_image(synthetic_image(100), "f.bin");
  EXPECT_EQ(image.entry, 0x3F8002U);
  EXPECT_EQ(image.blocks, 2);
}

TEST(FalconImage, RefusesOtherFilesAndNamesTheByte) {
  const std::vector<std::uint8_t> good = synthetic_image(100);
  auto bad = good;
  bad[0] = 0;
  EXPECT_NE(refusal(bad).find("f.bin: byte 0: expected the key 0x8AA"), std::string::npos)
      << refusal(bad);
  bad = good;
  bad.resize(good.size() - 2);
  EXPECT_NE(refusal(bad).find("expected a block or the end mark"), std::string::npos);
  bad = good;
  bad.resize(good.size() - 20);
  EXPECT_NE(refusal(bad).find("runs past the end"), std::string::npos);
  bad = good;
  bad.push_back(0);
  EXPECT_NE(refusal(bad).find("expected the end of the file"), std::string::npos);
  EXPECT_FALSE(refusal({}).empty());
  EXPECT_FALSE(refusal({0xAA, 0x08}).empty());
}

TEST(FalconImage, TruncatedAndCorruptedStreamsAreRefusedOrWellFormed) {
  const std::vector<std::uint8_t> good = synthetic_image(40);
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(refusal({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)}).empty())
        << size;
  }
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int round = 0; round < 5000; ++round) {
    auto noise = good;
    noise[random.below(noise.size())] = static_cast<std::uint8_t>(random.next());
    refusal(noise);  // no crash, no reading past the end (sanitizers)
  }
}

TEST(FalconImage, NamesAFileThatIsMissingOrAFolder) {
  for (const std::string& file : {std::string("/nowhere/firmware.bin"), ::testing::TempDir()}) {
    try {
      read_image(file);
      ADD_FAILURE() << file;
    } catch (const protocols::InputError& error) {
      EXPECT_NE(std::string(error.what()).find("None is shipped"), std::string::npos)
          << error.what();
    }
  }
}

TEST(FalconImage, ReadsAFile) {
  const auto bytes = synthetic_image(64);
  const palpate::testing::TemporaryFolder folder;
  const std::string file = folder / "image.bin";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  EXPECT_EQ(read_image(file).bytes, bytes);
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
