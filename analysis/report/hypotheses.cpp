#include "analysis/report/hypotheses.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "analysis/text.h"
#include "data/base/json_text.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kMostHypotheses = 100, kMostExpression = 2'000, kMostWords = 5'000;

void put_numbers(const std::string& name, const nlohmann::json& value, NamedResults& out) {
  if (value.is_object()) {
    for (const auto& [key, inner] : value.items())
      put_numbers(name.empty() ? key : name + "." + key, inner, out);
  } else if (value.is_number()) {
    out[name] = value.get<double>();
  } else if (value.is_boolean()) {
    out[name] = value.get<bool>() ? 1 : 0;
  } else if (value.is_null()) {
    out[name] = std::nan("");
  }
}

void put_short_names(NamedResults& out) {
  NamedResults found;
  for (const ShortName& one : kShortNames) {
    const std::string_view key = one.key, name = one.name;
    const std::size_t star = key.find('*'), name_star = name.find('*');
    if (star == std::string_view::npos) {
      if (const auto at = out.find(key); at != out.end()) found[one.name] = at->second;
      continue;
    }
    const std::string_view begin = key.substr(0, star), end = key.substr(star + 1);
    for (auto at = out.lower_bound(begin); at != out.end() && at->first.starts_with(begin); ++at) {
      const std::string_view full = at->first;
      if (full.size() <= begin.size() + end.size() || !full.ends_with(end)) continue;
      const std::string_view level =
          full.substr(begin.size(), full.size() - begin.size() - end.size());
      if (level.find('.') != std::string_view::npos) continue;
      found[std::string(name.substr(0, name_star)) + std::string(level) +
            std::string(name.substr(name_star + 1))] = at->second;
    }
  }
  out.merge(found);
}

/// An expression; its names become columns of `used`.
Pattern read_expression(const std::string& text, const NamedResults& known,
                        std::vector<std::string>& used) {
  std::vector<std::string> names;
  for (const auto& [name, value] : known) names.push_back(name);
  const auto resolve = [&](const std::string& name) -> std::optional<std::size_t> {
    if (!known.empty() && !known.contains(name)) return std::nullopt;
    const auto at = std::ranges::find(used, name);
    if (at == used.end()) used.push_back(name);
    return static_cast<std::size_t>(std::ranges::find(used, name) - used.begin());
  };
  return {text, resolve, names, "the analysis"};
}

bool is_id(const std::string& text) {
  return !text.empty() && text.size() <= 40 && text.front() != '-' &&
         std::ranges::all_of(text, [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '-';
         });
}

std::string read_text(const char* key, std::size_t most, protocols::ObjectReader& reader) {
  const nlohmann::json* const value = reader.member(key, protocols::Presence::required);
  if (value == nullptr) return "";
  if (value->is_string()) {
    const auto& text = value->get_ref<const std::string&>();
    if (!text.empty() && text.size() <= most) return text;
  }
  reader.faults().add(reader.pointer(key), "expected a text of 1 to " + std::to_string(most) +
                                               " characters" + protocols::found_text(*value));
  return "";
}

std::string read_condition(const char* key, const NamedResults& known,
                           protocols::ObjectReader& reader) {
  std::string text = read_text(key, kMostExpression, reader);
  if (text.empty()) return text;
  try {
    std::vector<std::string> used;
    read_expression(text, known, used);
    if (used.empty())
      reader.faults().add(reader.pointer(key),
                          "expected a condition on a number of the analysis; this one is always "
                          "the same");
  } catch (const PatternError& error) {
    // A fault is one line: drop the expression with its mark, which the file shows.
    const std::string said = error.what();
    reader.faults().add(reader.pointer(key), said.substr(0, said.find('\n')));
  }
  return text;
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::corroborated:
      return "corroborated";
    case Verdict::refuted:
      return "refuted";
    case Verdict::undecided:
      break;
  }
  return "undecided";
}

NamedResults named_results(const std::string& analysis, double alpha) {
  NamedResults out;
  const nlohmann::json json = read_json(analysis);
  if (json.contains("identification")) put_numbers("", json["identification"], out);
  NamedResults own;
  put_numbers("", json, own);
  own.merge(out);
  out = std::move(own);
  put_short_names(out);
  out["alpha"] = alpha;
  return out;
}

std::vector<Hypothesis> read_hypotheses(const std::string& text, const std::string& file,
                                        const NamedResults& known) {
  protocols::FaultList faults(file);
  const nlohmann::json json = protocols::read_json(text, faults);
  std::vector<Hypothesis> out;
  if (!json.is_array() || json.empty() || json.size() > kMostHypotheses) {
    faults.add("", "expected a list of 1 to " + std::to_string(kMostHypotheses) +
                       " hypotheses, [{\"id\": \"H1\", \"text\": ..., \"corroborated\": ..., "
                       "\"refuted\": ...}]" +
                       (json.is_array() ? "" : protocols::found_text(json)));
    faults.throw_if_any();
  }
  std::set<std::string> ids;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const std::string pointer = protocols::child_pointer("", i);
    protocols::ObjectReader reader(json[i], pointer, faults);
    Hypothesis one;
    one.id = read_text("id", 40, reader);
    if (!one.id.empty() && !is_id(one.id)) {
      faults.add(reader.pointer("id"),
                 "expected letters, digits and '-', found '" + printable(one.id, 60) + "'");
    } else if (!one.id.empty() && !ids.insert(one.id).second) {
      faults.add(reader.pointer("id"), "expected each id once, found '" + one.id + "' again");
    }
    one.text = read_text("text", kMostWords, reader);
    one.corroborated = read_condition("corroborated", known, reader);
    one.refuted = read_condition("refuted", known, reader);
    reader.refuse_unknown_keys();
    out.push_back(std::move(one));
  }
  faults.throw_if_any();
  return out;
}

Judgement judge(const Hypothesis& hypothesis, const NamedResults& results) {
  std::vector<std::string> used;
  const Pattern corroborated = read_expression(hypothesis.corroborated, {}, used);
  const Pattern refuted = read_expression(hypothesis.refuted, {}, used);
  Judgement out;
  for (const std::string& name : used) {
    const auto found = results.find(name);
    out.numbers.emplace_back(name, found == results.end() ? std::nan("") : found->second);
  }
  const auto value = [&](std::size_t column) { return out.numbers[column].second; };
  out.corroborated = corroborated.holds(value);
  out.refuted = refuted.holds(value);
  if (out.corroborated == true && out.refuted == false) out.verdict = Verdict::corroborated;
  if (out.refuted == true && out.corroborated == false) out.verdict = Verdict::refuted;
  return out;
}

}  // namespace palpate::analysis
