#pragma once
// The list of faults of a mesh.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace palpate::stimuli {

/// Collects the faults of a mesh: the first few of each kind in full, then a count.
class MeshFaults {
 public:
  static constexpr std::size_t kShown = 3;  ///< faults of one kind that are given in full

  /// `describe` makes the message; it is called only when the message will be shown.
  template <class Describe>
  void add(const char* kind, Describe describe) {
    Kind& entry = entry_of(kind);
    if (++entry.count <= kShown) entry.messages.push_back(std::string(kind) + ": " + describe());
  }

  bool empty() const { return kinds_.empty(); }
  std::vector<std::string> messages() const;
  void throw_if_any() const;  ///< \throws MeshError

 private:
  struct Kind {
    std::string name;
    std::size_t count = 0;
    std::vector<std::string> messages;
  };
  Kind& entry_of(const char* kind);

  std::vector<Kind> kinds_;
};

}  // namespace palpate::stimuli
