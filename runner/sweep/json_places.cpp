#include "runner/sweep/json_places.h"

#include <algorithm>
#include <charconv>

#include "stimuli/text.h"

namespace palpate::runner {
namespace {

using nlohmann::json;

std::vector<std::string> tokens_of(const std::string& pointer) {
  std::vector<std::string> tokens;
  for (json::json_pointer left(pointer); !left.empty(); left.pop_back())
    tokens.push_back(left.back());
  std::reverse(tokens.begin(), tokens.end());
  return tokens;
}

template <class Json>
Json* element(Json& array, const std::string& token) {
  std::size_t index = 0;
  const char* const end = token.data() + token.size();
  const auto read = std::from_chars(token.data(), end, index);
  const bool number = read.ec == std::errc() && read.ptr == end && std::to_string(index) == token;
  return number && index < array.size() ? &array[index] : nullptr;
}

}  // namespace

const json* value_at(const json& document, const std::string& pointer) {
  const json* at = &document;
  for (const std::string& token : tokens_of(pointer)) {
    if (at->is_array()) {
      at = element(*at, token);
    } else if (at->is_object()) {
      const auto member = at->find(token);
      at = member == at->end() ? nullptr : &*member;
    } else {
      return nullptr;
    }
    if (at == nullptr) return nullptr;
  }
  return at;
}

bool set_value(json& document, const std::string& pointer, const json& value) {
  json* at = &document;
  for (const std::string& token : tokens_of(pointer)) {
    if (at->is_array()) {
      at = element(*at, token);
      if (at == nullptr) return false;
    } else if (at->is_object() || at->is_null()) {
      at = &(*at)[token];
    } else {
      return false;
    }
  }
  *at = value;
  return true;
}

std::vector<std::string> near_pointers(const json& document, const std::string& pointer,
                                       std::size_t most) {
  std::vector<std::pair<std::size_t, std::string>> found;
  const std::string last = pointer.substr(pointer.rfind('/') + 1);
  const json flat = document.flatten();
  for (const auto& [place, value] : flat.items()) {
    // One that only stands elsewhere is as near as one that is misspelt by two letters.
    const std::size_t elsewhere =
        2 + stimuli::edit_distance(last, place.substr(place.rfind('/') + 1));
    const std::size_t edits = std::min(stimuli::edit_distance(pointer, place), elsewhere);
    if (edits <= 2 + last.size() / 2) found.emplace_back(edits, place);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> out;
  for (const auto& [edits, place] : found) {
    if (out.size() == most) break;
    if (out.empty() || edits <= found.front().first + 2) out.push_back(place);
  }
  return out;
}

}  // namespace palpate::runner
