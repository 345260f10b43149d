#pragma once
// Reads the members of a JSON object into plain values and records every fault with its location.
// A value that is at fault leaves the variable as it was.

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "protocols/fault_list.h"
#include "stimuli/vec.h"

namespace palpate::protocols {

/// A name is part of file names and heads a column.
inline constexpr std::size_t kMaxName = 64;

/// The range of numbers that a key accepts.
struct NumberRange {
  double min, max;
  const char* unit = "";
  bool above_min = false;  ///< min itself is excluded
};

enum class Presence { optional, required };

/// ", found ..." with the value as written, shortened.
std::string found_text(const nlohmann::json& value);

/// One of several words. False and a fault otherwise.
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
             "expected " + (options.size() > 1 ? "one of " + words : words) + found_text(value));
  return false;
}

/// A number of a range. False and a fault otherwise.
bool read_number(const nlohmann::json& value, const std::string& pointer, double& out,
                 const NumberRange& range, FaultList& faults);

/// A text without U+0000, of at most `most` bytes. False and a fault otherwise.
bool read_text(const nlohmann::json& value, const std::string& pointer, std::string& out,
               std::size_t most, FaultList& faults);

/// A unit quaternion [w, x, y, z]; within 1e-6 of unit length, then normalised. nullopt and a fault
/// otherwise.
std::optional<Quat> read_quaternion(const nlohmann::json& value, const std::string& pointer,
                                    FaultList& faults);

class ObjectReader {
 public:
  /// Records a fault when the value is not an object; then its members count as missing, without
  /// further faults.
  ObjectReader(const nlohmann::json& value, std::string pointer, FaultList& faults);

  const std::string& pointer() const { return pointer_; }
  std::string pointer(const std::string& key) const { return child_pointer(pointer_, key); }
  FaultList& faults() { return faults_; }
  bool has(const std::string& key) const { return object_ != nullptr && object_->contains(key); }

  void number(const char* key, double& out, const NumberRange& range,
              Presence presence = Presence::optional);
  void number(const char* key, std::optional<double>& out,
              const NumberRange& range);  ///< null: none
  void integer(const char* key, int& out, const NumberRange& range,
               Presence presence = Presence::optional);
  void integer(const char* key, std::optional<int>& out, const NumberRange& range);  ///< null: none
  /// Whole numbers that an int may not hold; range.max at most 2^53. null: none
  void count(const char* key, std::size_t& out, const NumberRange& range);  ///< required
  void count(const char* key, std::optional<std::size_t>& out, const NumberRange& range);
  void seed(const char* key, std::uint64_t& out);
  void boolean(const char* key, bool& out);
  void text(const char* key, std::string& out);
  void text(const char* key, std::string& out, std::size_t most);  ///< required; bytes
  void checksum(const char* key, std::string& out);                ///< required; SHA-256 in hex
  void name(const char* key, std::string& out);  ///< required; letters, digits, '-'
  void vector(const char* key, Vec3& out, const NumberRange& range,
              Presence presence = Presence::optional);
  void quaternion(const char* key, Quat& out);

  /// Whether the object has a member "sha256" (json_checksum); a wrong one is a fault.
  bool sealed();

  template <class T, class Options = std::initializer_list<std::pair<const char*, T>>>
  void choice(const char* key, T& out, const Options& options,
              Presence presence = Presence::optional) {
    const nlohmann::json* const value = member(key, presence);
    if (value != nullptr) read_choice(*value, pointer(key), out, options, faults_);
  }

  /// The member as JSON; nullptr when it is missing (a fault when it is required).
  const nlohmann::json* member(const char* key, Presence presence = Presence::optional);
  /// The member if it is an array of least .. most elements; else nullptr and a fault.
  const nlohmann::json* array(const char* key, std::size_t least, std::size_t most,
                              Presence presence = Presence::optional);

  /// Reads an object within this one: read(ObjectReader&). Its unknown keys become faults.
  template <class Read>
  void section(const char* key, Read read, Presence presence = Presence::optional) {
    const nlohmann::json* const value = member(key, presence);
    if (value == nullptr) return;
    ObjectReader inner(*value, pointer(key), faults_);
    read(inner);
    inner.refuse_unknown_keys();
  }

  /// Makes every key that was not asked for a fault, with the most similar known one.
  void refuse_unknown_keys();

 private:
  const nlohmann::json* object_;  // nullptr: not an object
  std::string pointer_;
  FaultList& faults_;
  std::set<std::string> known_;
};

}  // namespace palpate::protocols
