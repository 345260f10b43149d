#include "protocols/json_document.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace palpate {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxDepth = 64;             // objects and arrays within each other
constexpr std::uintmax_t kMaxBytes = 16u << 20u;  // a long list of orientations has about 1 MB

/// Walks over the text and tells how far the reader has come: its callbacks do not.
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
    key_ = name;
    if (open_.back().value->contains(name)) {
      const std::string pointer = child_pointer(open_.back().pointer, name);
      faults_.set_line(pointer, line());
      faults_.add(pointer, "each key at most once; this one is given again");
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
    // read:
    // ...": ours says where in its own way, and leaves out what may be long or ill-formed.
    const std::size_t message = what.find(": ");
    if (what.find("parse error at") != std::string::npos && message != std::string::npos) {
      what = what.substr(message + 2);
      what = what.substr(0, what.find("; last read"));
    } else {
      what = "number out of range: '" + last_token + "'";
    }
    faults_.add_syntax_error(static_cast<int>(newlines) + 1, static_cast<int>(end - line_start) + 1,
                             "expected JSON in UTF-8: " + what);
    return false;
  }

 private:
  struct Open {
    json* value;
    std::string pointer;
  };

  // The last character that was read may belong to what follows (a number ends where it does not
  // go on), so it does not count yet.
  int line() {
    const char* const end = std::max(counted_, reached_ == text_.data() ? reached_ : reached_ - 1);
    line_ += static_cast<int>(std::count(counted_, end, '\n'));
    counted_ = end;
    return line_;
  }

  json* put(json value) {
    std::string pointer;
    json* place = &root_;
    if (!open_.empty()) {
      Open& parent = open_.back();
      if (parent.value->is_array()) {
        pointer = child_pointer(parent.pointer, parent.value->size());
        parent.value->push_back(std::move(value));
        place = &parent.value->back();
      } else {
        pointer = child_pointer(parent.pointer, key_);
        place = &(*parent.value)[key_];
        *place = std::move(value);
      }
    } else {
      root_ = std::move(value);
    }
    faults_.set_line(pointer, line());
    pointer_ = pointer;
    return place;
  }

  bool open(json value) {
    if (open_.size() == kMaxDepth) {
      faults_.add(open_.back().pointer, "objects and arrays at most " + std::to_string(kMaxDepth) +
                                            " deep within each other");
      return false;
    }
    json* const place = put(std::move(value));
    open_.push_back({place, pointer_});
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
  std::string key_, pointer_;
};

}  // namespace

void FaultList::add(const std::string& pointer, const std::string& expected) {
  faults_.push_back({file_, pointer.empty() ? "/" : pointer, expected, line_of(pointer)});
}

void FaultList::add_syntax_error(int line, int column, const std::string& expected) {
  const std::string place = "line " + std::to_string(line) + ", column " + std::to_string(column);
  faults_.push_back({file_, place, expected, line});
}

void FaultList::throw_if_any() const {
  if (!faults_.empty()) throw InputError(faults_);
}

int FaultList::line_of(std::string pointer) const {
  // What is missing has no line; then that of the object that lacks it.
  for (;;) {
    const auto found = lines_.find(pointer);
    if (found != lines_.end()) return found->second;
    if (pointer.empty()) return 0;
    pointer.resize(pointer.rfind('/'));
  }
}

std::string child_pointer(const std::string& parent, const std::string& key) {
  std::string pointer = parent + "/";
  for (const char c : key) {
    if (c == '~') {
      pointer += "~0";
    } else if (c == '/') {
      pointer += "~1";
    } else {
      pointer += c;
    }
  }
  return pointer;
}

std::string child_pointer(const std::string& parent, std::size_t index) {
  return parent + "/" + std::to_string(index);
}

json read_json(const std::string& text, FaultList& faults) { return Builder(text, faults).build(); }

std::string read_text_file(const std::string& path) {
  const auto refuse = [&](const std::string& why) {
    throw InputError({{path, "(file)", "a readable JSON file: " + why, 0}});
  };
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) refuse("this is a folder");
  std::ifstream stream(path, std::ios::binary);
  if (!stream)
    refuse(std::filesystem::exists(path, error) ? "it cannot be opened" : "there is none");
  std::string text;
  std::array<char, 1 << 16> buffer{};
  while (stream.read(buffer.data(), buffer.size()) || stream.gcount() > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kMaxBytes) {
      refuse("it has more than " + std::to_string(kMaxBytes >> 20u) + " MB");
    }
  }
  if (stream.bad()) refuse("reading it failed");
  return text;
}

}  // namespace palpate
