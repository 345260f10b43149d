#include "protocols/tested_effects.h"

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace palpate::protocols {
namespace {

constexpr std::size_t kMostTests = 100;

/// The effects that the analysis may test, in the order in which it names products.
std::vector<std::string> sources_of_effects(const Protocol& protocol) {
  std::vector<std::string> out;
  if (protocol.groups.any()) out.emplace_back("group");
  if (protocol.renderers.size() > 1) out.emplace_back("renderer");
  for (const Factor& factor : protocol.factors) out.push_back(factor.name);
  const auto is_identification = [](const TaskBlock& block) {
    return block.task == TaskKind::identify && block.stimuli.size() > 1;
  };
  if (std::ranges::any_of(protocol.blocks, is_identification)) out.emplace_back("shape");
  return out;
}

std::string joined_effects(const std::vector<std::string>& names, const char* between) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : between) + name;
  return out;
}

/// "": the effect is one of these sources, or a product of them in their order.
std::string fault_of_effect(const std::string& effect, const std::vector<std::string>& sources) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= effect.size();) {
    const std::size_t end = std::min(effect.find(':', at), effect.size());
    parts.push_back(effect.substr(at, end - at));
    at = end + 1;
  }
  std::vector<std::string> known;
  for (const std::string& source : sources) {
    if (std::ranges::find(parts, source) != parts.end()) known.push_back(source);
  }
  if (known.size() != parts.size())
    return "expected one of '" + joined_effects(sources, "', '") +
           "', or a product of them such as 'a:b', found '" + effect + "'";
  if (joined_effects(known, ":") == effect) return "";
  return "expected '" + joined_effects(known, ":") + "', as the analysis names it, found '" +
         effect + "'";
}

}  // namespace

void read_tested_effects(ObjectReader& reader, Protocol& protocol) {
  if (!reader.has("tests")) {
    reader.member("tests");
    return;
  }
  const nlohmann::json* const list = reader.array("tests", 1, kMostTests);
  if (list == nullptr) return;
  const std::vector<std::string> sources = sources_of_effects(protocol);
  if (protocol.factors.empty() && !protocol.groups.any()) {
    reader.faults().add(reader.pointer("tests"),
                        "expected no tests: the protocol has neither groups nor factors");
    return;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const nlohmann::json& one = (*list)[i];
    const std::string place = child_pointer(reader.pointer("tests"), i);
    if (!one.is_string()) {
      reader.faults().add(place, "expected the name of an effect" + found_text(one));
      continue;
    }
    const auto effect = one.get<std::string>();
    if (const std::string fault = fault_of_effect(effect, sources); !fault.empty()) {
      reader.faults().add(place, fault);
    } else if (std::ranges::find(protocol.tests, effect) != protocol.tests.end()) {
      reader.faults().add(place, "expected each effect once, found '" + effect + "' again");
    } else {
      protocol.tests.push_back(effect);
    }
  }
}

}  // namespace palpate::protocols
