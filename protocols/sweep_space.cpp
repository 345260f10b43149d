#include "protocols/sweep_space.h"

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>
#include <string_view>

#include "protocols/json_document.h"
#include "protocols/object_reader.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxParameters = 200;
constexpr std::size_t kMaxPaths = 100;
constexpr std::size_t kMaxChoices = 1000;
constexpr double kLargest = 1e12;  // larger values are mistakes

/// Share of a standard normal distribution below z. Accurate in both tails.
double normal_share(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

double normal_value(double share) {
  return -std::numbers::sqrt2 * boost::math::erfc_inv(2 * share);
}

// Beyond this, a tail (6e-300 of the distribution) has no digits left in double precision.
constexpr double kFarthestSd = 37;

/// Standard deviations between the mean and the nearer limit; 0: the mean lies within.
double sd_from_mean(const SweepParameter& p) {
  return std::max({(p.low - p.mean) / p.sd, (p.mean - p.high) / p.sd, 0.0});
}

/// Value of a normal distribution truncated at both limits. Shares near 1 have no digits left, so
/// they are computed from the upper tail instead.
double cut_normal_value(const SweepParameter& p, double u) {
  if (u <= 0) return p.low;
  if (u >= 1) return p.high;
  const double low = (p.low - p.mean) / p.sd, high = (p.high - p.mean) / p.sd;
  // The limits are so close that shares between them are indistinguishable; the density is constant
  // to 1e-7.
  if ((high - low) * std::max({1.0, std::fabs(low), std::fabs(high)}) < 1e-7)
    return std::clamp(p.low + u * (p.high - p.low), p.low, p.high);
  const auto from_below = [&](double from, double to, double part) {
    const double left_out = normal_share(from);
    return left_out + part * (normal_share(to) - left_out);
  };
  const double below = from_below(low, high, u);
  const bool mirrored = low > 0 || !(below < 1);
  const double share = mirrored ? from_below(-high, -low, 1 - u) : below;
  if (!(share > 0)) return low > 0 ? p.low : p.high;  // beyond kFarthestSd
  const double z = normal_value(share);
  return std::clamp(p.mean + p.sd * (mirrored ? -z : z), p.low, p.high);
}

/// Uses the ratio if it is finite, so that the points of existing plans stay the same to the bit.
double log_uniform_value(const SweepParameter& p, double u) {
  const double ratio = p.high / p.low;
  const double value = std::isfinite(ratio)
                           ? p.low * std::exp(u * std::log(ratio))
                           : std::exp(std::log(p.low) + u * (std::log(p.high) - std::log(p.low)));
  return std::clamp(value, p.low, p.high);
}

bool is_name(const std::string& text) {
  return !text.empty() && text.size() <= kMaxName &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; });
}

/// RFC 6901: "/a/0/b"; ~ only as ~0 or ~1.
bool is_pointer(const std::string& text) {
  if (text.size() < 2 || text[0] != '/') return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '~') continue;
    if (i + 1 == text.size() || (text[i + 1] != '0' && text[i + 1] != '1')) return false;
  }
  return true;
}

void read_path(const json& value, const std::string& place, SweepParameter& out,
               FaultList& faults) {
  if (!value.is_string() || !is_pointer(value.get_ref<const std::string&>())) {
    faults.add(place,
               "expected a JSON pointer such as '/motor/reaction_delay_s'" + found_text(value));
    return;
  }
  const std::string path = value.get<std::string>();
  if (std::find(out.paths.begin(), out.paths.end(), path) != out.paths.end()) {
    faults.add(place, "expected each pointer once" + found_text(value) + " again");
  }
  out.paths.push_back(path);
}

void read_paths(ObjectReader& reader, SweepParameter& out) {
  const json* const value = reader.member("path", Presence::required);
  if (value == nullptr) return;
  if (!value->is_array()) {
    read_path(*value, reader.pointer("path"), out, reader.faults());
    return;
  }
  if (const json* const list = reader.array("path", 1, kMaxPaths)) {
    for (std::size_t i = 0; i < list->size(); ++i)
      read_path((*list)[i], child_pointer(reader.pointer("path"), i), out, reader.faults());
  }
}

void read_values(ObjectReader& reader, SweepParameter& out) {
  const json* const list = reader.array("values", 1, kMaxChoices, Presence::required);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& value = (*list)[i];
    const std::string place = child_pointer(reader.pointer("values"), i);
    if (!value.is_number() && !value.is_string() && !value.is_boolean()) {
      reader.faults().add(place, "expected a number, a text, true or false" + found_text(value));
    } else if (std::find(out.values.begin(), out.values.end(), value) != out.values.end()) {
      reader.faults().add(place, "expected each value once" + found_text(value) + " again");
    }
    out.values.push_back(value);
  }
}

void read_limits(ObjectReader& reader, SweepParameter& out) {
  const NumberRange range = out.distribution == DistributionKind::log_uniform
                                ? NumberRange{0, kLargest, "", true}
                                : NumberRange{-kLargest, kLargest};
  const bool both = reader.has("low") && reader.has("high");
  reader.number("low", out.low, range, Presence::required);
  reader.number("high", out.high, range, Presence::required);
  if (both && reader.member("low")->is_number() && reader.member("high")->is_number() &&
      !(reader.member("low")->get<double>() < reader.member("high")->get<double>())) {
    reader.faults().add(reader.pointer("high"),
                        "expected more than 'low'" + found_text(*reader.member("high")));
  }
}

/// Checks the limits if each of the four numbers is valid.
void check_normal(ObjectReader& reader, const SweepParameter& p) {
  for (const char* const key : {"low", "high", "mean", "sd"}) {
    const json* const value = reader.member(key);
    if (value == nullptr || !value->is_number()) return;
  }
  if (!(p.low < p.high) || !(p.sd > 0)) return;
  const double away = sd_from_mean(p);
  if (away <= kFarthestSd) return;
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", away);
  reader.faults().add(reader.pointer(p.low > p.mean ? "low" : "high"),
                      "expected limits that hold a part of the distribution: at most " +
                          std::to_string(static_cast<int>(kFarthestSd)) +
                          " sd from the mean, found both " + text + " sd or more " +
                          (p.low > p.mean ? "above" : "below") + " it");
}

/// "participant", "group:NAME" or "protocol".
void read_target(ObjectReader& reader, SweepParameter& out) {
  constexpr std::string_view kGroup = "group:";
  const json* const of = reader.member("of", Presence::required);
  if (of == nullptr) return;
  const std::string text = of->is_string() ? of->get<std::string>() : "";
  if (text == "protocol") out.of = SweptDocument::protocol;
  if (text.starts_with(kGroup)) out.group = text.substr(kGroup.size());
  if (text != "protocol" && text != "participant" && out.group.empty())
    reader.faults().add(reader.pointer("of"),
                        "expected 'participant', 'group:NAME' (participants of a group) or "
                        "'protocol'" +
                            found_text(*of));
}

SweepParameter read_parameter(ObjectReader& reader) {
  SweepParameter out;
  if (const json* const name = reader.member("name", Presence::required)) {
    if (name->is_string()) out.name = name->get<std::string>();
    if (!is_name(out.name)) {
      reader.faults().add(reader.pointer("name"),
                          "expected a name of 1 to " + std::to_string(kMaxName) +
                              " letters, digits, '_' and '-'" + found_text(*name));
    }
  }
  read_target(reader, out);
  read_paths(reader, out);
  reader.choice("distribution", out.distribution,
                {{to_string(DistributionKind::uniform), DistributionKind::uniform},
                 {to_string(DistributionKind::log_uniform), DistributionKind::log_uniform},
                 {to_string(DistributionKind::normal), DistributionKind::normal},
                 {to_string(DistributionKind::choice), DistributionKind::choice}},
                Presence::required);
  if (out.distribution == DistributionKind::choice) {
    read_values(reader, out);
    return out;
  }
  read_limits(reader, out);
  if (out.distribution != DistributionKind::normal) return out;
  reader.number("mean", out.mean, {-kLargest, kLargest}, Presence::required);
  reader.number("sd", out.sd, {0, kLargest, "", true}, Presence::required);
  check_normal(reader, out);
  return out;
}

/// Whether the pointers are the same, or one leads into the value that the other replaces.
bool overlap(const std::string& a, const std::string& b) {
  const std::string &shorter = a.size() < b.size() ? a : b, &longer = a.size() < b.size() ? b : a;
  return longer.starts_with(shorter) &&
         (longer.size() == shorter.size() || longer[shorter.size()] == '/');
}

void check_together(const SweepSpace& space, FaultList& faults) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < space.parameters.size(); ++i) {
    const SweepParameter& one = space.parameters[i];
    const std::string place = child_pointer("/parameters", i);
    if (!one.name.empty() && !names.insert(one.name).second) {
      faults.add(child_pointer(place, "name"),
                 "expected a unique name, found '" + one.name + "' again");
    }
    for (std::size_t j = 0; j < i; ++j) {
      const SweepParameter& other = space.parameters[j];
      if (other.of != one.of || other.group != one.group) continue;
      for (const std::string& a : one.paths) {
        for (const std::string& b : other.paths) {
          if (!overlap(a, b)) continue;
          faults.add(
              child_pointer(place, "path"),
              "expected pointers that no other parameter sets; '" + other.name + "' sets " + b);
        }
      }
    }
  }
}

}  // namespace

const char* to_string(DistributionKind kind) {
  switch (kind) {
    case DistributionKind::uniform:
      return "uniform";
    case DistributionKind::log_uniform:
      return "log_uniform";
    case DistributionKind::normal:
      return "normal";
    case DistributionKind::choice:
      return "choice";
  }
  return "";
}

json SweepParameter::value_at(double u) const {
  const double share = std::clamp(u, 0.0, 1.0);
  switch (distribution) {
    case DistributionKind::uniform:
      return std::clamp(low + share * (high - low), low, high);
    case DistributionKind::log_uniform:
      return log_uniform_value(*this, share);
    case DistributionKind::normal:
      return cut_normal_value(*this, share);
    case DistributionKind::choice:
      break;
  }
  const auto slot = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  return values.at(std::min(slot, values.size() - 1));
}

SweepSpace parse_sweep_space(const std::string& path) {
  return parse_sweep_space_text(read_text_file(path), path);
}

SweepSpace parse_sweep_space_text(const std::string& text, const std::string& file_name) {
  FaultList faults(file_name);
  const json root = read_json(text, faults);
  SweepSpace space;
  ObjectReader reader(root, "", faults);
  reader.member("$schema");
  reader.integer("version", space.version, {1, 1}, Presence::required);
  if (const json* const list = reader.array("parameters", 1, kMaxParameters, Presence::required)) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      ObjectReader parameter((*list)[i], child_pointer("/parameters", i), faults);
      space.parameters.push_back(read_parameter(parameter));
      parameter.refuse_unknown_keys();
    }
  }
  reader.refuse_unknown_keys();
  check_together(space, faults);
  faults.throw_if_any();
  space.source_text = text;
  return space;
}

}  // namespace palpate::protocols
