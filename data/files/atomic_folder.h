#pragma once
// Internal to data/: a folder of files that appears whole, under its name, or not at all.

#include <functional>
#include <string>

namespace palpate::data {

/// Draft folders lie beside their target, ".NAME.palpate-XXXXXX", private. One that a killed
/// program left behind is removed by the next draft for the same target.
class AtomicFolder {
 public:
  /// \throws StoreError: it cannot be made.
  explicit AtomicFolder(const std::string& target);
  ~AtomicFolder();  ///< removes it unless it has got its name
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  std::string operator/(const std::string& name) const { return draft_ + "/" + name; }
  /// The path of a file in it, whose folders are made.
  std::string place(const std::string& name) const;

  /// Everything is on the disk, then has its name; an old target is gone then. The target must not
  /// be there, or be an empty folder, unless `replace`.
  void commit(bool replace);

 private:
  [[noreturn]] void fail(const char* what, int error) const;
  std::string target_, draft_;
  int descriptor_ = -1;  // locked: this draft is being written
};

/// Whether an export may go to `target`. \param ours tells of a path within the folder whether an
/// export of that format has such a file; what it has not would be lost.
/// \throws StoreRefused: something is there and `force` is not given; with it: what is there is not
/// a folder that palpate exported, or holds other files as well.
void require_replaceable(const std::string& target, bool force,
                         const std::function<bool(const std::string&)>& ours);

}  // namespace palpate::data
