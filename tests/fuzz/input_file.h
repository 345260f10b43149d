#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace palpate::testing {

/// A file with an input's bytes, for what reads files: one for each process, written over by each
/// input, gone at the end.
class InputFile {
 public:
  explicit InputFile(const char* name) {
    const char* folder = std::getenv("TMPDIR");
    std::string pattern = std::string(folder ? folder : "/tmp") + "/palpate-fuzz-XXXXXX";
    if (!mkdtemp(pattern.data())) throw std::runtime_error(pattern + ": cannot be made");
    folder_ = pattern;
    path_ = folder_ + "/" + name;
  }
  ~InputFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::string& path() const { return path_; }

  const std::string& write(const std::uint8_t* data, std::size_t size) const {
    std::FILE* file = std::fopen(path_.c_str(), "wb");
    if (!file || std::fwrite(data, 1, size, file) != size) {
      throw std::runtime_error(path_ + ": cannot be written");
    }
    std::fclose(file);
    return path_;
  }

 private:
  std::string folder_, path_;
};

}  // namespace palpate::testing
