#include "runner/devices/falcon/image.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "protocols/parse.h"

namespace palpate::runner::falcon {
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

}  // namespace palpate::runner::falcon
