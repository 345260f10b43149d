#include "protocols/object_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/text.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr double kUnitTolerance = 1e-6;  // of a quaternion's length

std::string plain(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(10);
  out << value;
  return out.str();
}

std::string describe(const char* kind, const NumberRange& range) {
  const std::string unit = *range.unit == '\0' ? "" : std::string(" ") + range.unit;
  return "expected " + std::string(kind) + (range.above_min ? " above " : " from ") +
         plain(range.min) + (range.above_min ? " up to " : " to ") + plain(range.max) + unit;
}

bool contains(const NumberRange& range, double value) {
  return (range.above_min ? value > range.min : value >= range.min) && value <= range.max;
}

template <class Integer>
bool read_integer(const json& value, const std::string& pointer, Integer& out,
                  const NumberRange& range, FaultList& faults) {
  // JSON knows numbers only: 76.0 is an integer too.
  if (value.is_number()) {
    const double number = value.get<double>();
    if (contains(range, number) && std::floor(number) == number) {
      out = static_cast<Integer>(number);
      return true;
    }
  }
  faults.add(pointer, describe("an integer", range) + found_text(value));
  return false;
}

template <std::size_t N>
bool read_numbers(const json& value, const std::string& pointer, std::array<double, N>& out,
                  const NumberRange& range, FaultList& faults) {
  if (!value.is_array() || value.size() != N) {
    faults.add(pointer,
               "expected an array of " + std::to_string(N) + " numbers" + found_text(value));
    return false;
  }
  bool good = true;
  for (std::size_t i = 0; i < N; ++i) {
    good &= read_number(value[i], child_pointer(pointer, i), out[i], range, faults);
  }
  return good;
}

/// A SHA-256 as 64 digits 0-9 and a-f. False and a fault otherwise.
bool read_checksum(const json& value, const std::string& pointer, std::string& out,
                   FaultList& faults) {
  if (value.is_string() && is_checksum(value.get_ref<const std::string&>())) {
    out = value.get<std::string>();
    return true;
  }
  faults.add(pointer, "expected a SHA-256, 64 digits 0-9 and a-f" + found_text(value));
  return false;
}

}  // namespace

std::string found_text(const json& value) { return ", found " + json_excerpt(value); }

bool read_number(const json& value, const std::string& pointer, double& out,
                 const NumberRange& range, FaultList& faults) {
  if (value.is_number() && contains(range, value.get<double>())) {
    out = value.get<double>();
    return true;
  }
  faults.add(pointer, describe("a number", range) + found_text(value));
  return false;
}

bool read_text(const json& value, const std::string& pointer, std::string& out, std::size_t most,
               FaultList& faults) {
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    if (text.size() <= most && text.find('\0') == std::string::npos) {
      out = text;
      return true;
    }
  }
  faults.add(pointer, "expected a text of at most " + std::to_string(most) +
                          " bytes without U+0000" + found_text(value));
  return false;
}

std::optional<Quat> read_quaternion(const json& value, const std::string& pointer,
                                    FaultList& faults) {
  std::array<double, 4> wxyz{};
  if (!read_numbers(value, pointer, wxyz, {-1 - kUnitTolerance, 1 + kUnitTolerance}, faults)) {
    return std::nullopt;
  }
  const auto& [w, x, y, z] = wxyz;
  const double length = std::sqrt(w * w + x * x + y * y + z * z);
  if (std::abs(length - 1) > kUnitTolerance) {
    faults.add(pointer, "expected a unit quaternion [w, x, y, z] (within 1e-6)" +
                            found_text(value) + " of length " + plain(length));
    return std::nullopt;
  }
  return Quat(w / length, x / length, y / length, z / length);
}

ObjectReader::ObjectReader(const json& value, std::string pointer, FaultList& faults)
    : object_(value.is_object() ? &value : nullptr), pointer_(std::move(pointer)), faults_(faults) {
  if (object_ == nullptr) faults.add(pointer_, "expected an object" + found_text(value));
}

const json* ObjectReader::member(const char* key, Presence presence) {
  known_.insert(key);
  if (object_ == nullptr) return nullptr;
  const auto place = object_->find(key);
  if (place != object_->end()) return &*place;
  if (presence == Presence::required) faults_.add(pointer(key), "missing; this key is required");
  return nullptr;
}

const json* ObjectReader::array(const char* key, std::size_t least, std::size_t most,
                                Presence presence) {
  const json* const value = member(key, presence);
  if (value == nullptr) return nullptr;
  if (value->is_array() && value->size() >= least && value->size() <= most) return value;
  faults_.add(pointer(key), "expected an array of " + std::to_string(least) + " to " +
                                std::to_string(most) + " elements" +
                                (value->is_array() ? ", found " + std::to_string(value->size())
                                                   : found_text(*value)));
  return nullptr;
}

void ObjectReader::number(const char* key, double& out, const NumberRange& range,
                          Presence presence) {
  const json* const value = member(key, presence);
  if (value != nullptr) read_number(*value, pointer(key), out, range, faults_);
}

void ObjectReader::number(const char* key, std::optional<double>& out, const NumberRange& range) {
  const json* const value = member(key);
  double number = 0;
  if (value == nullptr || value->is_null()) return;
  if (read_number(*value, pointer(key), number, range, faults_)) out = number;
}

void ObjectReader::integer(const char* key, int& out, const NumberRange& range, Presence presence) {
  const json* const value = member(key, presence);
  if (value != nullptr) read_integer(*value, pointer(key), out, range, faults_);
}

void ObjectReader::integer(const char* key, std::optional<int>& out, const NumberRange& range) {
  const json* const value = member(key);
  int number = 0;
  if (value == nullptr || value->is_null()) return;
  if (read_integer(*value, pointer(key), number, range, faults_)) out = number;
}

void ObjectReader::count(const char* key, std::size_t& out, const NumberRange& range) {
  const json* const value = member(key, Presence::required);
  if (value != nullptr) read_integer(*value, pointer(key), out, range, faults_);
}

void ObjectReader::count(const char* key, std::optional<std::size_t>& out,
                         const NumberRange& range) {
  const json* const value = member(key, Presence::required);
  std::size_t number = 0;
  if (value == nullptr || value->is_null()) return;
  if (read_integer(*value, pointer(key), number, range, faults_)) out = number;
}

void ObjectReader::text(const char* key, std::string& out, std::size_t most) {
  const json* const value = member(key, Presence::required);
  if (value != nullptr) read_text(*value, pointer(key), out, most, faults_);
}

void ObjectReader::checksum(const char* key, std::string& out) {
  const json* const value = member(key, Presence::required);
  if (value != nullptr) read_checksum(*value, pointer(key), out, faults_);
}

bool ObjectReader::sealed() {
  const json* const value = member("sha256");
  if (value == nullptr) return false;
  std::string found;
  if (read_checksum(*value, pointer("sha256"), found, faults_) && found != json_checksum(*object_))
    faults_.add(pointer("sha256"), "expected the checksum of this object, " +
                                       json_checksum(*object_) + ", found " + found +
                                       ": it has changed since it was measured; measure again");
  return true;
}

void ObjectReader::seed(const char* key, std::uint64_t& out) {
  const json* const value = member(key);
  if (value == nullptr) return;
  constexpr double kExact = 9007199254740992.0;  // 2^53: up to here 2e3 is exact, as 2000 is
  if (value->is_number_unsigned()) {
    out = value->get<std::uint64_t>();
  } else if (value->is_number_float() && value->get<double>() >= 0 &&
             value->get<double>() <= kExact && std::floor(value->get<double>()) == *value) {
    out = static_cast<std::uint64_t>(value->get<double>());
  } else {
    faults_.add(pointer(key),
                "expected an integer from 0 to 18446744073709551615" + found_text(*value));
  }
}

void ObjectReader::boolean(const char* key, bool& out) {
  const json* const value = member(key);
  if (value == nullptr) return;
  if (value->is_boolean()) {
    out = value->get<bool>();
  } else {
    faults_.add(pointer(key), "expected true or false" + found_text(*value));
  }
}

void ObjectReader::text(const char* key, std::string& out) {
  const json* const value = member(key);
  if (value == nullptr) return;
  if (!value->is_string()) {
    faults_.add(pointer(key), "expected a text" + found_text(*value));
  } else if (value->get_ref<const std::string&>().find('\0') != std::string::npos) {
    faults_.add(pointer(key), "expected a text without U+0000" + found_text(*value));
  } else {
    out = value->get<std::string>();
  }
}

void ObjectReader::name(const char* key, std::string& out) {
  const json* const value = member(key, Presence::required);
  if (value == nullptr) return;
  if (value->is_string()) {
    const auto& word = value->get_ref<const std::string&>();
    const auto fits = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    };
    // Spreadsheets take a cell that starts with '-' for a formula.
    if (!word.empty() && word.size() <= kMaxName && word.front() != '-' &&
        std::all_of(word.begin(), word.end(), fits)) {
      out = word;
      return;
    }
  }
  faults_.add(pointer(key), "expected a name of 1 to " + std::to_string(kMaxName) +
                                " letters (a-z, A-Z), digits and '-', which does not begin it" +
                                found_text(*value));
}

void ObjectReader::vector(const char* key, Vec3& out, const NumberRange& range, Presence presence) {
  const json* const value = member(key, presence);
  std::array<double, 3> xyz{};
  if (value != nullptr && read_numbers(*value, pointer(key), xyz, range, faults_)) {
    out = Vec3(xyz[0], xyz[1], xyz[2]);
  }
}

void ObjectReader::quaternion(const char* key, Quat& out) {
  const json* const value = member(key);
  if (value == nullptr) return;
  if (const auto rotation = read_quaternion(*value, pointer(key), faults_)) out = *rotation;
}

void ObjectReader::refuse_unknown_keys() {
  if (object_ == nullptr) return;
  for (const auto& [key, value] : object_->items()) {
    if (known_.count(key) != 0) continue;
    if (faults_.full()) {
      faults_.add({}, {});
      continue;
    }
    std::string all;
    for (const std::string& known : known_) all += (all.empty() ? "" : ", ") + known;
    const std::string nearest = nearest_word(key, {known_.begin(), known_.end()});
    faults_.add(pointer(key), nearest.empty() ? "unknown key; known here: " + all
                                              : "unknown key; did you mean '" + nearest + "'?");
  }
}

}  // namespace palpate::protocols
