#pragma once
// A folder of its own for every test.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace palpate::testing {

/// A new, empty folder, which goes with all that is in it. Throws std::runtime_error if there is
/// none to be had.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(::testing::TempDir() + "palpate-XXXXXX") {
    if (::mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no temporary folder");
  }
  ~TemporaryFolder() {
    std::error_code ignored;  // nothing may throw here
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

}  // namespace palpate::testing
