#pragma once
// Reads the files of a ZIP archive in memory, through libzip.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

struct zip;

namespace palpate::stimuli {

/// Thrown to stop reading.
struct ZipRefused {
  std::string place;  ///< a file's name in the archive; empty: the archive
  std::string expected, found;
};

class ZipArchive {
 public:
  /// Files longer than this together are refused.
  static constexpr std::uint64_t kLongest = std::uint64_t{1} << 31U;

  /// Reads the directory. \param bytes  must live as long as the archive \throws ZipRefused
  explicit ZipArchive(std::string_view bytes);

  /// Names are compared without their case and without a slash in front (ECMA-376-2, 6.2.2.3).
  bool has(std::string_view name) const { return entries_.contains(key_of(name)); }
  std::size_t size() const { return entries_.size(); }
  std::uint64_t unpacked_size() const { return unpacked_; }  ///< bytes, of all files
  /// The form in which names are compared.
  static std::string key_of(std::string_view name);

  /// Hands over a file in pieces of at most 64 KiB, in order, until `take` returns false.
  /// \pre has(name) \throws ZipRefused: it is damaged, encrypted or packed by another method
  void read(std::string_view name, const std::function<bool(std::string_view)>& take) const;

 private:
  struct Entry {
    std::string name;
    std::uint64_t index = 0, unpacked = 0;
  };
  struct Discard {
    void operator()(zip* archive) const;
  };
  std::unique_ptr<zip, Discard> archive_;
  std::uint64_t unpacked_ = 0;
  std::map<std::string, Entry> entries_;
};

}  // namespace palpate::stimuli
