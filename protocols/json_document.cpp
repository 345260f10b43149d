#include "protocols/json_document.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include "data/base/input_file.h"
#include "data/base/json_text.h"
#include "data/base/text.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

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

}  // namespace

json read_json(const std::string& text, FaultList& faults) { return Builder(text, faults).build(); }

std::string read_text_file(const std::string& path) {
  try {
    return read_whole(path, kMaxBytes);
  } catch (const std::runtime_error& error) {
    throw InputError({{path, "(file)", std::string("a readable JSON file: ") + error.what(), 0}});
  }
}

}  // namespace palpate::protocols
