#pragma once
// Reads the members of a JSON object into plain values and records every fault with its place.
// A value that is at fault leaves the variable as it was.

#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "protocols/json_document.h"
#include "stimuli/vec.h"

namespace palpate::protocols {

/// The numbers that a key takes.
struct Interval {
  double min, max;
  const char* unit = "";
  bool above_min = false;  ///< min itself is not in it
};

enum class Need { optional, required };

/// ", found ..." with the value as it stands, shortened.
std::string found(const nlohmann::json& value);

/// One of some words. False and a fault otherwise.
template <class T, class Options = std::initializer_list<std::pair<const char*, T>>>
bool read_choice(const nlohmann::json& value, const std::string& pointer, T& out,
                 const Options& options, FaultList& faults) {
  std::string words;
  for (const auto& [word, meaning] : options) {
    if (value.is_string() && value.get_ref<const std::string&>() == word) {
      out = meaning;
      return true;
    }
    words += (words.empty() ? "'" : ", '") + std::string(word) + "'";
  }
  faults.add(pointer,
             "expected " + (options.size() > 1 ? "one of " + words : words) + found(value));
  return false;
}

/// A unit quaternion [w, x, y, z]; within 1e-6 of unit length, then normalised. nullopt and a fault
/// otherwise.
std::optional<Quat> read_quaternion(const nlohmann::json& value, const std::string& pointer,
                                    FaultList& faults);

class ObjectReader {
 public:
  /// Records a fault when the value is no object; then all members count as missing but unasked
  /// for.
  ObjectReader(const nlohmann::json& value, std::string pointer, FaultList& faults);

  const std::string& pointer() const { return pointer_; }
  std::string pointer(const std::string& key) const { return child_pointer(pointer_, key); }
  FaultList& faults() { return faults_; }
  bool has(const std::string& key) const { return object_ != nullptr && object_->contains(key); }

  void number(const char* key, double& out, const Interval& interval, Need need = Need::optional);
  void number(const char* key, std::optional<double>& out,
              const Interval& interval);  ///< null: none
  void integer(const char* key, int& out, const Interval& interval, Need need = Need::optional);
  void integer(const char* key, std::optional<int>& out, const Interval& interval);  ///< null: none
  void seed(const char* key, std::uint64_t& out);
  void boolean(const char* key, bool& out);
  void text(const char* key, std::string& out);
  void name(const char* key, std::string& out);  ///< required; letters, digits, '-'
  void vector(const char* key, Vec3& out, const Interval& interval);
  void quaternion(const char* key, Quat& out);

  template <class T, class Options = std::initializer_list<std::pair<const char*, T>>>
  void choice(const char* key, T& out, const Options& options, Need need = Need::optional) {
    const nlohmann::json* const value = member(key, need);
    if (value != nullptr) read_choice(*value, pointer(key), out, options, faults_);
  }

  /// The member for reading by hand; nullptr when it is missing (a fault when it is required).
  const nlohmann::json* member(const char* key, Need need = Need::optional);
  /// The member if it is an array of least .. most elements; else nullptr and a fault.
  const nlohmann::json* array(const char* key, std::size_t least, std::size_t most,
                              Need need = Need::optional);

  /// Reads an object within this one: read(ObjectReader&). Its unknown keys become faults.
  template <class Read>
  void section(const char* key, Read read, Need need = Need::optional) {
    const nlohmann::json* const value = member(key, need);
    if (value == nullptr) return;
    ObjectReader inner(*value, pointer(key), faults_);
    read(inner);
    inner.refuse_unknown_keys();
  }

  /// Makes every key that nobody asked for a fault, with the nearest known one.
  void refuse_unknown_keys();

 private:
  const nlohmann::json* object_;  // nullptr: not an object
  std::string pointer_;
  FaultList& faults_;
  std::set<std::string> known_;
};

}  // namespace palpate::protocols
