#pragma once
// Files that are longer than a message: the page sends them in parts, which are put together in the
// temporary folder.

#include <cstddef>
#include <map>
#include <string>

namespace palpate::runner::design {

/// Bytes of a file that is sent in parts.
inline constexpr std::size_t kMostUploaded = 512U << 20;

class Uploads {
 public:
  explicit Uploads(std::string folder) : folder_(std::move(folder)) {}

  /// Begins a file, of which there are few at a time: the oldest goes. \return its key
  std::string begin();
  /// Adds a part. \return the bytes so far. \throws UsageError: there is no such key, or the file
  /// is too long, which ends it
  std::size_t add(const std::string& key, const std::string& bytes);
  /// The whole file, which is gone then. \throws UsageError
  std::string take(const std::string& key);

 private:
  std::string path_of(const std::string& key) const { return folder_ + "/" + key + ".part"; }
  void remove(const std::string& key);
  void require(const std::string& key) const;

  std::string folder_;
  std::map<std::string, std::size_t> bytes_;  ///< of each key
};

}  // namespace palpate::runner::design
