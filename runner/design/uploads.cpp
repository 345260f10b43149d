#include "runner/design/uploads.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include "runner/serve/loopback.h"
#include "runner/usage_error.h"

namespace palpate::runner::design {

std::string Uploads::begin() {
  constexpr std::size_t kAtATime = 2;
  while (bytes_.size() >= kAtATime) remove(bytes_.begin()->first);
  std::string key = serve::make_token();
  bytes_[key] = 0;
  return key;
}

std::size_t Uploads::add(const std::string& key, const std::string& bytes) {
  require(key);
  if (bytes_[key] + bytes.size() > kMostUploaded) {
    remove(key);
    throw UsageError("The file is above " + std::to_string(kMostUploaded >> 20) +
                     " MiB: copy it beside the protocol, and add a stimulus of the shape mesh.");
  }
  std::ofstream file(path_of(key), std::ios::binary | std::ios::app);
  file << bytes;
  file.close();
  if (!file) {
    remove(key);
    throw UsageError("There is no room for the file in " + folder_ + ".");
  }
  return bytes_[key] += bytes.size();
}

std::string Uploads::take(const std::string& key) {
  require(key);
  std::ifstream file(path_of(key), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  remove(key);
  return bytes;
}

void Uploads::remove(const std::string& key) {
  std::error_code none;
  std::filesystem::remove(path_of(key), none);
  bytes_.erase(key);
}

void Uploads::require(const std::string& key) const {
  if (!bytes_.contains(key))
    throw UsageError("upload: expected the key of a file that is being sent");
}

}  // namespace palpate::runner::design
