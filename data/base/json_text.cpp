#include "data/base/json_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "data/base/checksum.h"

namespace palpate {
namespace {

template <class Json>
Json read(std::string_view text) {
  using Event = typename Json::parse_event_t;
  const auto within_depth = [](int around, Event event, Json&) {
    const bool opens = event == Event::object_start || event == Event::array_start;
    if (!opens || static_cast<std::size_t>(around) < kDeepestJson) return true;
    throw JsonError(
        "objects and arrays at most " + std::to_string(kDeepestJson) + " deep within each other",
        "deeper ones");
  };
  try {
    return Json::parse(text, within_depth);
  } catch (const typename Json::parse_error& error) {
    // The parser counts bytes from 1 and points behind the readable part.
    const std::size_t byte = error.byte > 0 ? error.byte - 1 : 0;
    throw JsonError("JSON in UTF-8", "other text at byte " + std::to_string(byte),
                    std::min(byte, text.size()));
  } catch (const typename Json::out_of_range&) {
    throw JsonError("JSON with numbers below 1e308", "a larger one");
  }
}

/// The first `most` characters of a value as JSON, or somewhat more.
void put_start(const nlohmann::json& value, std::size_t most, std::string& out) {
  // Escape all but ASCII: a truncated character must not make the message ill-formed.
  const auto ascii = [](const nlohmann::json& word) {
    return word.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  };
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    out += text.size() > most ? ascii(text.substr(0, most)) : ascii(value);
  } else if (value.is_structured()) {
    const bool object = value.is_object();
    out += object ? '{' : '[';
    for (const auto& [key, member] : value.items()) {
      if (out.size() >= most) return;
      if (out.back() != '{' && out.back() != '[') out += ',';
      if (object) out += ascii(key.substr(0, most)) + ':';
      put_start(member, most, out);
    }
    out += object ? '}' : ']';
  } else {
    out += ascii(value);
  }
}

}  // namespace

JsonError::JsonError(std::string wanted, std::string seen, std::optional<std::size_t> place)
    : std::runtime_error("expected " + wanted + ", found " + seen),
      expected(std::move(wanted)),
      found(std::move(seen)),
      byte(place) {}

nlohmann::json read_json(std::string_view text) { return read<nlohmann::json>(text); }

nlohmann::ordered_json read_ordered_json(std::string_view text) {
  return read<nlohmann::ordered_json>(text);
}

nlohmann::json json_or_discarded(std::string_view text) {
  try {
    return read_json(text);
  } catch (const JsonError&) {
    return nlohmann::json(nlohmann::json::value_t::discarded);
  }
}

std::string json_checksum(const nlohmann::json& object) {
  nlohmann::json body = object;
  if (body.is_object()) body.erase("sha256");
  return checksum_hex(body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

std::string json_excerpt(const nlohmann::json& value, std::size_t most) {
  std::string text;
  put_start(value, most + 1, text);
  return text.size() > most ? text.substr(0, most - 3) + "..." : text;
}

}  // namespace palpate
