#pragma once
// A file that a user named, read with limits: whatever stands behind the name, reading it ends.

#include <cstddef>
#include <cstdint>
#include <string>

namespace palpate::stimuli {

class InputFile {
 public:
  /// A pipe into which nobody writes for so long is given up.
  static constexpr int kPatienceSeconds = 10;

  /// \throws std::runtime_error, without the path: it is a folder, cannot be opened.
  /// \param most_bytes  a file that goes on after them is refused
  InputFile(const std::string& path, std::uintmax_t most_bytes);
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile();

  /// Up to `size` bytes, one at least; 0 at the end.
  /// \throws std::runtime_error, without the path: nobody writes, it is too long, reading failed.
  std::size_t read(char* to, std::size_t size);

 private:
  void wait() const;

  int file_;
  std::uintmax_t most_, so_far_ = 0;
};

/// All of it. \throws as InputFile.
std::string read_whole(const std::string& path, std::uintmax_t most_bytes);

}  // namespace palpate::stimuli
