#pragma once
// Reads a file named by the user, with limits on size and waiting, so that reading always ends (a
// pipe, /dev/zero).

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace palpate {

class InputFile {
 public:
  /// How long a pipe may stay silent before reading gives up.
  static constexpr int kPatienceSeconds = 10;

  /// \throws std::runtime_error, without the path: it is a folder, cannot be opened.
  /// \param most_bytes  a longer file is refused
  InputFile(const std::string& path, std::uintmax_t most_bytes);
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile();

  /// Reads 1 to `size` bytes; returns 0 at the end.
  /// \throws std::runtime_error, without the path: the pipe is silent, it is too long, reading
  /// failed.
  std::size_t read(char* to, std::size_t size);

 private:
  void wait() const;

  int file_;
  std::uintmax_t most_, so_far_ = 0;
};

/// The whole file. \throws as InputFile.
std::string read_whole(const std::string& path, std::uintmax_t most_bytes);

/// Numbers in binary files.
/// Reads an unsigned little-endian number of `size` (1 to 4) bytes, which must exist, at byte `at`.
inline std::uint32_t little_endian(std::string_view bytes, std::size_t at, std::size_t size = 4) {
  std::uint32_t word = 0;
  for (std::size_t i = size; i-- > 0;)
    word = word << 8U | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

}  // namespace palpate
