#include "protocols/json_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "data/base/checksum.h"
#include "data/base/input_file.h"
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

constexpr std::size_t kMaxKeyBytes = 256;         // the longest known key has 20
constexpr std::size_t kMaxValues = 200'000;       // a long list of orientations has 50,000
constexpr std::uintmax_t kMaxBytes = 16u << 20u;  // a long list of orientations has about 1 MB

/// Iterates over the text and records how far the parser has read: its callbacks do not say.
struct TrackingIterator {
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  const char* at = nullptr;
  const char** reached = nullptr;

  reference operator*() const { return *at; }
  TrackingIterator& operator++() {
    ++at;
    *reached = at;
    return *this;
  }
  TrackingIterator operator++(int) {
    TrackingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const TrackingIterator& other) const { return at == other.at; }
  bool operator!=(const TrackingIterator& other) const { return at != other.at; }
};

/// Builds the document from the parser's events.
class Builder : public nlohmann::json_sax<json> {
 public:
  Builder(const std::string& text, FaultList& faults)
      : text_(text), faults_(faults), counted_(text.data()), reached_(text.data()) {}

  json build() {
    const TrackingIterator begin{text_.data(), &reached_};
    const TrackingIterator end{text_.data() + text_.size(), &reached_};
    if (!json::sax_parse(begin, end, this)) faults_.throw_if_any();
    return std::move(root_);
  }

  bool null() override { return put(nullptr) != nullptr; }
  bool boolean(bool value) override { return put(value) != nullptr; }
  bool number_integer(number_integer_t value) override { return put(value) != nullptr; }
  bool number_unsigned(number_unsigned_t value) override { return put(value) != nullptr; }
  bool number_float(number_float_t value, const string_t&) override {
    return put(value) != nullptr;
  }
  bool string(string_t& value) override { return put(value) != nullptr; }
  bool binary(binary_t&) override { return false; }  // not in texts

  bool start_object(std::size_t) override { return open(json::object()); }
  bool start_array(std::size_t) override { return open(json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    if (name.size() > kMaxKeyBytes) {
      faults_.add(here(), "keys of at most " + std::to_string(kMaxKeyBytes) +
                              " bytes, found one of " + std::to_string(name.size()) + " on line " +
                              std::to_string(line()));
      return false;
    }
    key_ = name;
    if (open_.back().value->contains(name)) {
      faults_.set_line(open_.back().pointer.child(name), line());
      faults_.add(faults_.full() ? std::string() : child_pointer(here(), name),
                  "each key at most once; this one is given again");
    }
    return true;
  }

  bool parse_error(std::size_t position, const std::string& last_token,
                   const json::exception& error) override {
    const std::size_t end = std::min(position == 0 ? 0 : position - 1, text_.size());
    const std::string before = text_.substr(0, end);
    const auto newlines = std::count(before.begin(), before.end(), '\n');
    const std::size_t line_start = before.rfind('\n') + 1;  // npos + 1 is 0
    std::string what = error.what();
    // "[json.exception.parse_error.101] parse error at line 2, column 1: syntax error ...; last
    // read: ...": the location is given separately, and the rest may be long or ill-formed.
    const std::size_t message = what.find(": ");
    if (what.find("parse error at") != std::string::npos && message != std::string::npos) {
      what = what.substr(message + 2);
      what = what.substr(0, what.find("; last read"));
    } else {
      what = "number out of range: '" + last_token + "'";
    }
    if (is_utf16(text_)) what = "it is in UTF-16; save it as UTF-8";
    faults_.add_syntax_error(static_cast<int>(newlines) + 1, static_cast<int>(end - line_start) + 1,
                             "expected JSON in UTF-8: " + what + comma_at(end));
    return false;
  }

 private:
  /// A hint for "0,5" between keys: a decimal comma. In a list these are two numbers.
  std::string comma_at(std::size_t end) const {
    const std::string_view text = text_;
    const auto in_number = [](char c) { return (c >= '0' && c <= '9') || c == ',' || c == '-'; };
    std::size_t first = std::min(end, text.size()), last = first;
    while (first > 0 && end - first < 40 && in_number(text[first - 1])) --first;
    while (last < text.size() && last - end < 40 && in_number(text[last])) ++last;
    return point_meant(text.substr(first, last - first));
  }

  struct Open {
    json* value;
    PointerHash pointer;
    std::string token;  // key or index in the one around it
  };

  /// The pointer of the innermost open object or array. Built only for a fault: a pointer for every
  /// value would copy all keys above it each time.
  std::string here() const {
    std::string pointer;
    for (std::size_t i = 1; i < open_.size(); ++i) pointer = child_pointer(pointer, open_[i].token);
    return pointer;
  }

  // The last character read may belong to the next token (a number ends at the next character), so
  // it does not count yet.
  int line() {
    const char* const end = std::max(counted_, reached_ == text_.data() ? reached_ : reached_ - 1);
    line_ += static_cast<int>(std::count(counted_, end, '\n'));
    counted_ = end;
    return line_;
  }

  /// nullptr where there are too many.
  json* put(json value) {
    if (++values_ > kMaxValues) {
      faults_.add(here(), "at most " + std::to_string(kMaxValues) +
                              " values in all; this one is on line " + std::to_string(line()));
      return nullptr;
    }
    token_.clear();
    pointer_ = PointerHash();
    json* put = &root_;
    if (!open_.empty()) {
      Open& parent = open_.back();
      if (parent.value->is_array()) {
        token_ = std::to_string(parent.value->size());
        parent.value->push_back(std::move(value));
        put = &parent.value->back();
      } else {
        token_ = key_;
        put = &(*parent.value)[key_];
        *put = std::move(value);
      }
      pointer_ = parent.pointer.child(token_);
    } else {
      root_ = std::move(value);
    }
    faults_.set_line(pointer_, line());
    return put;
  }

  bool open(json value) {
    if (open_.size() == kDeepestJson) {
      faults_.add(here(), "objects and arrays at most " + std::to_string(kDeepestJson) +
                              " deep within each other");
      return false;
    }
    json* const opened = put(std::move(value));
    if (opened == nullptr) return false;
    open_.push_back({opened, pointer_, token_});
    return true;
  }

  bool close() {
    open_.pop_back();
    return true;
  }

  const std::string& text_;
  FaultList& faults_;
  const char* counted_;
  const char* reached_;
  int line_ = 1;
  json root_;
  std::vector<Open> open_;
  std::size_t values_ = 0;
  std::string key_, token_;  // token_, pointer_: of the value that was put last
  PointerHash pointer_;
};

/// With ~ and / escaped (RFC 6901).
void escape(std::string_view token, std::string& out) {
  for (const char c : token) {
    if (c == '~') {
      out += "~0";
    } else if (c == '/') {
      out += "~1";
    } else {
      out += c;
    }
  }
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

void PointerHash::add(std::string_view characters) {
  for (const char c : characters) {
    value_ ^= static_cast<unsigned char>(c);
    value_ *= 1099511628211U;
  }
}

PointerHash PointerHash::child(std::string_view token) const {
  std::string escaped = "/";
  escape(token, escaped);
  PointerHash out = *this;
  out.add(escaped);
  return out;
}

void FaultList::add(const std::string& pointer, const std::string& expected) {
  if (full()) {
    ++unlisted_;
  } else {
    faults_.push_back({file_, pointer.empty() ? "/" : pointer, expected, line_of(pointer)});
  }
}

void FaultList::add_syntax_error(int line, int column, const std::string& expected) {
  const std::string location =
      "line " + std::to_string(line) + ", column " + std::to_string(column);
  faults_.push_back({file_, location, expected, line});
}

void FaultList::throw_if_any() const {
  if (faults_.empty()) return;
  std::vector<Fault> all = faults_;
  if (unlisted_ > 0) {
    all.push_back(
        {file_, "further locations", "and " + std::to_string(unlisted_) + " more faults"});
  }
  throw InputError(std::move(all));
}

int FaultList::line_of(std::string_view pointer) const {
  // A missing value has no line; use the line of the object that lacks it.
  for (;;) {
    const auto found = lines_.find(PointerHash(pointer).value());
    if (found != lines_.end()) return found->second;
    if (pointer.empty()) return 0;
    pointer = pointer.substr(0, pointer.rfind('/'));
  }
}

std::string child_pointer(const std::string& parent, const std::string& key) {
  std::string pointer = parent + "/";
  escape(key, pointer);
  return pointer;
}

std::string child_pointer(const std::string& parent, std::size_t index) {
  return parent + "/" + std::to_string(index);
}

json read_json(const std::string& text, FaultList& faults) { return Builder(text, faults).build(); }

std::string read_text_file(const std::string& path) {
  try {
    return read_whole(path, kMaxBytes);
  } catch (const std::runtime_error& error) {
    throw InputError({{path, "(file)", std::string("a readable JSON file: ") + error.what(), 0}});
  }
}

}  // namespace palpate::protocols
