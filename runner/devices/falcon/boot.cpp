#include "runner/devices/falcon/boot.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "protocols/parse.h"
#include "runner/devices/falcon/packets.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr std::uint32_t kKey = 0x08AA;
constexpr std::size_t kHeader =
    std::size_t{2} * (1 + 8 + 2);              // bytes: key, reserved words, entry point
constexpr std::uintmax_t kMaxBytes = 1 << 18;  // the processor's whole memory

[[noreturn]] void refuse(const std::string& file, std::size_t at, const std::string& expected) {
  throw protocols::InputError(
      {{file, "byte " + std::to_string(at),
        expected + ": this is no firmware of a Falcon (a boot stream of TI's C28x "
                   "processors)"}});
}

std::string hex(std::uint32_t word) {
  std::ostringstream text;
  text << std::hex << std::uppercase << "0x" << word;
  return text.str();
}

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 3> kMonitorProbe = {0x0A, 0x43, 0x0D};
constexpr std::array<std::uint8_t, 4> kMonitorReply = {0x0A, 0x44, 0x2C, 0x0D};
constexpr std::array<std::uint8_t, 1> kLock = {0x41};  // the boot ROM measures the bit rate from it
// Each echo fills an IN packet, so that the chip's 16 ms timer does not delay it.
constexpr std::size_t kChunk = 62;

/// One upload failed; another may succeed.
class AttemptFailed : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Receives `count` bytes, or fewer on time-out.
std::vector<std::uint8_t> receive(Transport& transport, std::size_t count, std::int64_t wait_ns) {
  std::vector<std::uint8_t> bytes(count);
  std::size_t have = 0;
  const std::int64_t end = transport.now_ns() + wait_ns;
  while (have < count) {
    const std::int64_t left = end - transport.now_ns();
    if (left <= 0 || transport.gone()) break;
    have += transport.receive(std::span(bytes).subspan(have), left);
  }
  bytes.resize(have);
  return bytes;
}

void purge(Transport& transport) {
  transport.control(request::kPurge, 1);
  transport.control(request::kPurge, 2);
  std::array<std::uint8_t, 256> stale{};
  while (transport.receive(stale, 0) > 0) {
  }
}

void send(Transport& transport, Bytes bytes) {
  if (transport.send(bytes)) return;
  if (transport.gone()) {
    throw TransportError("the Falcon " + transport.serial() + " was unplugged while starting");
  }
  throw AttemptFailed("bytes could not be sent");
}

/// Searches for the monitor's answer in all received bytes: others may precede it.
void wake_monitor(Transport& transport, const BootSettings& settings) {
  for (int probe = 0; probe < settings.monitor_probes; ++probe) {
    send(transport, kMonitorProbe);
    std::vector<std::uint8_t> heard;
    const std::int64_t end = transport.now_ns() + settings.monitor_wait_ns;
    for (std::int64_t left = settings.monitor_wait_ns; left > 0; left = end - transport.now_ns()) {
      const auto more = receive(transport, 1, left);
      heard.insert(heard.end(), more.begin(), more.end());
      if (std::search(heard.begin(), heard.end(), kMonitorReply.begin(), kMonitorReply.end()) !=
          heard.end()) {
        return;
      }
      if (transport.gone()) break;
    }
  }
  throw AttemptFailed("the monitor did not answer (is the device's power supply on?)");
}

void expect_echo(Transport& transport, Bytes sent, std::size_t at, std::int64_t wait_ns) {
  const auto echo = receive(transport, sent.size(), wait_ns);
  if (echo.size() < sent.size()) {
    throw AttemptFailed("the echo was lost at byte " + std::to_string(at + echo.size()));
  }
  const auto wrong = std::mismatch(sent.begin(), sent.end(), echo.begin()).first;
  if (wrong != sent.end()) {
    throw AttemptFailed("a wrong echo at byte " +
                        std::to_string(at + static_cast<std::size_t>(wrong - sent.begin())));
  }
}

void upload(Transport& transport, const FirmwareImage& image, const BootSettings& settings,
            BootProgress progress, const BootReport& report) {
  const auto tell = [&progress, &report] {
    if (report) report(progress);
  };
  progress.step = BootProgress::Step::monitor;
  tell();
  purge(transport);
  transport.control(request::kEvent, kEventNone);
  transport.control(request::kLatency, 16);
  transport.control(request::kBaud, kBaudMonitor);
  transport.control(request::kFormat, 8);
  transport.control(request::kFlow, 0);
  transport.control(request::kModem, kRtsLow);
  transport.control(request::kModem, kDtrLow);
  transport.control(request::kModem, kDtrHigh);
  wake_monitor(transport, settings);

  transport.control(request::kModem, kDtrLow);
  transport.control(request::kBaud, kBaudBoot);
  purge(transport);  // discard late answers to further probes
  send(transport, kLock);
  expect_echo(transport, kLock, 0, settings.echo_wait_ns);

  progress.step = BootProgress::Step::uploading;
  progress.size = image.bytes.size();
  for (std::size_t at = 0; at < image.bytes.size(); at += kChunk) {
    const Bytes chunk = Bytes(image.bytes).subspan(at, std::min(kChunk, image.bytes.size() - at));
    send(transport, chunk);
    // The echo is the only check: the stream has no checksum.
    expect_echo(transport, chunk, at, settings.echo_wait_ns);
    progress.sent = at + chunk.size();
    tell();
  }
}

}  // namespace

FirmwareImage parse_image(std::vector<std::uint8_t> bytes, const std::string& file) {
  const auto word = [&bytes](std::size_t at) {
    return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8;
  };
  if (bytes.size() < kHeader + 2) {
    refuse(file, bytes.size(), "expected at least " + std::to_string(kHeader + 2) + " bytes");
  }
  if (word(0) != kKey) refuse(file, 0, "expected the key 0x8AA, found " + hex(word(0)));
  FirmwareImage image;
  image.entry = word(18) << 16 | word(20);
  std::size_t at = kHeader;
  for (;;) {
    if (at + 2 > bytes.size()) refuse(file, at, "expected a block or the end mark, found nothing");
    const std::size_t words = word(at);
    at += 2;
    if (words == 0) break;
    const std::size_t end = at + 4 + 2 * words;
    if (end > bytes.size()) {
      refuse(file, at - 2,
             "a block of " + std::to_string(words) + " words runs past the end (" +
                 std::to_string(bytes.size()) + " bytes)");
    }
    at = end;
    ++image.blocks;
  }
  if (image.blocks == 0) refuse(file, kHeader, "expected at least one block");
  if (at != bytes.size()) refuse(file, at, "expected the end of the file after the end mark");
  image.bytes = std::move(bytes);
  return image;
}

FirmwareImage read_image(const std::string& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw protocols::InputError(
        {{file, "",
          "expected a firmware file. None is shipped: name the one of the Falcon's "
          "own driver or of a libnifalcon checkout"}});
  }
  if (std::filesystem::file_size(file, error) > kMaxBytes || error) {
    throw protocols::InputError({{file, "", "expected at most 256 KiB of firmware"}});
  }
  std::ifstream in(file, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in),
                                  std::istreambuf_iterator<char>()};
  if (!in) throw protocols::InputError({{file, "", "cannot be read; check its permissions"}});
  return parse_image(std::move(bytes), file);
}

bool firmware_runs(Transport& transport, const BootSettings& settings) {
  transport.control(request::kLatency, 1);
  transport.control(request::kEvent, kEventReplyEnd);
  transport.control(request::kBaud, kBaudNormal);
  purge(transport);
  const Packet zero = encode(Command{});
  PacketStream stream;  // shared by all probes: a slow machine may read one reply in several parts
  for (int probe = 0; probe < settings.packet_probes && !transport.gone(); ++probe) {
    if (!transport.send(zero)) continue;
    const std::int64_t end = transport.now_ns() + settings.packet_wait_ns;
    for (std::int64_t left = settings.packet_wait_ns; left > 0; left = end - transport.now_ns()) {
      for (const std::uint8_t byte : receive(transport, 1, left)) {
        const auto packet = stream.take(byte);
        if (packet && decode_reply(*packet)) return true;
      }
      if (transport.gone()) break;
    }
  }
  if (transport.gone()) {
    throw TransportError("the Falcon " + transport.serial() + " was unplugged while starting");
  }
  return false;
}

void boot(Transport& transport, const FirmwareImage* image, const BootSettings& settings,
          const BootReport& report) {
  BootProgress progress;
  if (report) report(progress);
  if (!firmware_runs(transport, settings)) {
    if (image == nullptr) {
      throw TransportError(
          "the Falcon " + transport.serial() +
          " has no firmware (it is lost when the device is switched off): name a file with "
          "--firmware, from its own driver or a libnifalcon checkout");
    }
    std::string troubles;
    bool runs = false;
    for (; progress.attempt <= settings.uploads; ++progress.attempt) {
      try {
        upload(transport, *image, settings, progress, report);
        runs = firmware_runs(transport, settings);
        if (runs) break;
        throw AttemptFailed("the firmware did not answer after its upload");
      } catch (const AttemptFailed& failed) {
        progress.trouble = failed.what();
        troubles += "\n  attempt " + std::to_string(progress.attempt) + ": " + failed.what();
        transport.reopen();
      }
    }
    if (!runs) {
      throw TransportError("the Falcon " + transport.serial() + " did not accept its firmware in " +
                           std::to_string(settings.uploads) + " attempts:" + troubles);
    }
  }
  progress.step = BootProgress::Step::running;
  if (report) report(progress);
}

}  // namespace palpate::runner::devices::falcon
