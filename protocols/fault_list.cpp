#include "protocols/fault_list.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate::protocols {
namespace {

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

}  // namespace

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

}  // namespace palpate::protocols
