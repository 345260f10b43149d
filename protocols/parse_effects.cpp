#include "protocols/parse_effects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "stimuli/texture.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;
using Kind = stimuli::TextureSpec::Kind;
using FieldKind = stimuli::FieldSpec::Kind;

constexpr NumberRange kPeriod{1e-4, 0.1, "m"};
constexpr NumberRange kDepth{0, 0.005, "m"};
constexpr NumberRange kDirection{-1e3, 1e3};
constexpr NumberRange kPhase{-360, 360, "degrees"};
constexpr NumberRange kRidge{0, 0.1, "m"};
constexpr NumberRange kRamp{0, 0.1, "m", true};
constexpr NumberRange kTip{0, 0.005, "m"};
constexpr NumberRange kShare{0, 1};
constexpr NumberRange kExponent{0, 4};
constexpr NumberRange kLongest{1e-4, 6.4, "m"};
constexpr double kMostWaves = 64;  // periods of a longest wave: fewer than 8 values a shortest one
constexpr double kSteepest = 2;    // of a slope: steeper, the carved wall is nearly a step
constexpr double kThin = 0.25;     // a flat object: one side by the others
constexpr double kAlongNormal = 0.996;  // cosine of 5 degrees

constexpr NumberRange kForce{-100, 100, "N"};
constexpr NumberRange kPoint{-10, 10, "m"};
constexpr NumberRange kRadius{0, 10, "m"};
constexpr NumberRange kStiffness{0, 1e5, "N/m"};
constexpr NumberRange kDamping{-1000, 1000, "N s/m"};
constexpr NumberRange kLowPass{0, 1, "s"};
constexpr NumberRange kAmplitude{0, 100, "N"};
constexpr NumberRange kFrequency{0.1, 2500, "Hz"};
constexpr std::size_t kMostFields = 8;

constexpr NumberRange kKnock{0, 100, "N s/m"};
constexpr NumberRange kKnockFrequency{10, 2500, "Hz"};
constexpr NumberRange kDecay{0.001, 0.1, "s"};

/// A direction, scaled to unit length.
void read_direction(ObjectReader& reader, const char* key, Vec3& out, Presence presence) {
  Vec3 read = out;
  reader.vector(key, read, kDirection, presence);
  if (!reader.has(key)) return;
  if (const double length = glm::length(read); length > 0) {
    out = read / length;
  } else {
    reader.faults().add(reader.pointer(key), "expected a direction that is not zero");
  }
}

/// m; the sides of a primitive's box; zero where they are not known here.
Vec3 box_of(const stimuli::ObjectSpec& spec) {
  switch (spec.shape) {
    case stimuli::ShapeKind::sphere:
      return Vec3(2 * spec.radius);
    case stimuli::ShapeKind::cone:
    case stimuli::ShapeKind::cylinder:
      return {2 * spec.radius, 2 * spec.radius, spec.height};
    case stimuli::ShapeKind::cube:
      return Vec3(spec.edge);
    case stimuli::ShapeKind::box:
      return spec.size;
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;
  }
  return Vec3(0);
}

bool has_layers(const stimuli::ObjectSpec& spec) {
  if (spec.shape != stimuli::ShapeKind::compound) return !spec.material.layers.empty();
  return std::any_of(spec.parts.begin(), spec.parts.end(), has_layers);
}

void read_picture(ObjectReader& section, const MeshFiles& files, stimuli::TextureSpec& texture) {
  std::string name;
  section.text("file", name);
  const json* const value = section.member("file", Presence::required);
  if (value == nullptr || !value->is_string()) return;
  texture.file_name = name;
  texture.file = (std::filesystem::path(files.folder) / name).string();
  texture.file_bytes = read_kept_file(section, "file", "PNG file", files);
}

void refuse_key(ObjectReader& section, const char* key, bool refused, const char* why) {
  if (section.member(key) != nullptr && refused) section.faults().add(section.pointer(key), why);
}

void read_texture_keys(ObjectReader& section, const MeshFiles& files,
                       stimuli::TextureSpec& texture) {
  section.choice("kind", texture.kind,
                 {{"sine", Kind::sine},
                  {"trapezoid", Kind::trapezoid},
                  {"cones", Kind::cones},
                  {"noise", Kind::noise},
                  {"image", Kind::image}},
                 Presence::required);
  section.number("period_m", texture.period, kPeriod, Presence::required);
  section.number("depth_m", texture.depth, kDepth, Presence::required);
  const json* const direction = section.member("direction");
  if (direction != nullptr && direction->is_string()) {
    read_choice(*direction, section.pointer("direction"), texture.around, {{"around", true}},
                section.faults());
  } else {
    read_direction(section, "direction", texture.direction, Presence::optional);
  }
  section.number("phase_deg", texture.phase, kPhase);
  const bool known = section.has("kind");  // without it no key is too much
  const bool flanks = texture.kind == Kind::trapezoid || texture.kind == Kind::cones;
  section.number("ridge_m", texture.ridge, kRidge);
  section.number("ramp_m", texture.ramp, kRamp);
  for (const char* key : {"ridge_m", "ramp_m"})
    refuse_key(section, key, known && !flanks, "expected on kinds trapezoid and cones only");
  section.number("tip_radius_m", texture.tip_radius, kTip);
  section.number("jitter", texture.jitter, kShare);
  refuse_key(section, "jitter", known && texture.kind != Kind::cones,
             "expected on kind cones only");
  section.seed("seed", texture.seed);
  refuse_key(section, "seed", known && texture.kind != Kind::cones && texture.kind != Kind::noise,
             "expected on kinds cones and noise only");
  section.number("exponent", texture.exponent, kExponent);
  section.number("longest_m", texture.longest, kLongest);
  for (const char* key : {"exponent", "longest_m"})
    refuse_key(section, key, known && texture.kind != Kind::noise, "expected on kind noise only");
  if (texture.kind == Kind::image) {
    read_picture(section, files, texture);
  } else {
    refuse_key(section, "file", known, "expected on kind image only");
  }
}

/// Faults what the numbers say together.
void check_texture(ObjectReader& section, const stimuli::ObjectSpec& spec) {
  const stimuli::TextureSpec& texture = *spec.texture;
  const auto fault = [&](const char* key, const auto&... parts) {
    std::ostringstream text;
    (text << ... << parts);
    section.faults().add(section.pointer(key), text.str());
  };
  const double ridge = stimuli::ridge_of(texture), ramp = stimuli::ramp_of(texture);
  if (texture.kind == Kind::trapezoid && ridge + 2 * ramp > texture.period * (1 + 1e-9)) {
    return fault(section.has("ramp_m") ? "ramp_m" : "ridge_m",
                 "expected ridge_m and two flanks of ramp_m within period_m: ", ridge, " and 2 x ",
                 ramp, " m are more than ", texture.period, " m");
  }
  if (texture.longest &&
      (*texture.longest < texture.period || *texture.longest > kMostWaves * texture.period)) {
    return fault("longest_m", "expected 1 to ", kMostWaves, " times period_m");
  }
  const bool round = spec.shape == stimuli::ShapeKind::sphere ||
                     spec.shape == stimuli::ShapeKind::cone ||
                     spec.shape == stimuli::ShapeKind::cylinder;
  if (texture.around && !round)
    return fault("direction",
                 "expected a direction [x, y, z]: \"around\" is for a sphere, cone or "
                 "cylinder");
  if (texture.around && texture.kind != Kind::sine && texture.kind != Kind::trapezoid)
    return fault("direction",
                 "expected a direction [x, y, z]: \"around\" is for the kinds sine and "
                 "trapezoid");
  const Vec3 box = box_of(spec);
  const double thickness = std::min({box.x, box.y, box.z});
  if (thickness > 0 && texture.depth > thickness) {
    return fault("depth_m", "expected at most the thickness of the object, ", thickness, " m");
  }
  if (thickness > 0 && !texture.around) {
    for (int i = 0; i < 3; ++i) {
      const double others = std::min(box[(i + 1) % 3], box[(i + 2) % 3]);
      if (box[i] <= kThin * others && std::abs(texture.direction[i]) > kAlongNormal)
        return fault("direction",
                     "expected a direction along the flat object's faces: across "
                     "them no texture would be felt");
    }
  }
  if (const double slope = stimuli::asked_slope(texture); slope > kSteepest) {
    return fault(
        "depth_m", "expected a slope of at most ", kSteepest, "; it is ", slope,
        texture.kind == Kind::sine ? " (pi depth_m / period_m)" : " (1.5 depth_m / ramp_m)");
  }
  if (texture.depth == 0 || (texture.kind != Kind::noise && texture.kind != Kind::image)) return;
  if (texture.kind == Kind::image && texture.file_bytes == nullptr) return;  // a fault already
  try {
    const double slope = stimuli::Texture(texture, spec.radius).greatest_slope();
    if (slope > kSteepest)
      fault("depth_m", "expected a slope of at most ", kSteepest, "; the steepest is ", slope);
  } catch (const std::invalid_argument& unreadable) {
    fault(texture.kind == Kind::image ? "file" : "kind", unreadable.what());
  }
}

void read_texture(ObjectReader& reader, const MeshFiles& files, stimuli::ObjectSpec& spec) {
  reader.section("texture", [&](ObjectReader& section) {
    spec.texture.emplace();
    const std::size_t before = section.faults().count();
    read_texture_keys(section, files, *spec.texture);
    if (section.faults().count() == before) check_texture(section, spec);
  });
  if (!reader.has("texture")) return;
  const auto refuse = [&](const char* why) { reader.faults().add(reader.pointer("texture"), why); };
  if (spec.soft) refuse("expected texture or soft, not both: a soft surface has no fine structure");
  if (has_layers(spec)) refuse("expected texture or layers, not both");
  if (spec.shape == stimuli::ShapeKind::none)
    refuse("expected an object with a surface: shape 'none' has fields alone");
}

void read_matrix(ObjectReader& section, Mat3& out) {
  const json* const value = section.member("damping_ns_per_m", Presence::required);
  if (value == nullptr) return;
  if (value->is_number()) {
    double number = 0;
    section.number("damping_ns_per_m", number, kDamping);
    out = Mat3(number);
    return;
  }
  const json* const rows = section.array("damping_ns_per_m", 3, 3);
  if (rows == nullptr) return;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string row = child_pointer(section.pointer("damping_ns_per_m"), i);
    if (!(*rows)[i].is_array() || (*rows)[i].size() != 3) {
      section.faults().add(row, "expected 3 numbers, a row of a matrix" + found_text((*rows)[i]));
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      double number = 0;
      read_number((*rows)[i][k], child_pointer(row, k), number, kDamping, section.faults());
      out[static_cast<int>(k)][static_cast<int>(i)] = number;
    }
  }
}

/// Whether B + B^T has no negative eigenvalue: by its principal minors.
bool dissipates(const Mat3& b) {
  const Mat3 s = b + glm::transpose(b);
  const double size = std::max({std::abs(s[0][0]), std::abs(s[1][1]), std::abs(s[2][2]),
                                std::abs(s[0][1]), std::abs(s[0][2]), std::abs(s[1][2])});
  const double least = -1e-12 * size;
  for (int i = 0; i < 3; ++i) {
    const int k = (i + 1) % 3;
    if (s[i][i] < least) return false;
    if (s[i][i] * s[k][k] - s[i][k] * s[i][k] < least * size) return false;
  }
  return glm::determinant(s) >= least * size * size;
}

void read_field_keys(ObjectReader& reader, stimuli::FieldSpec& field) {
  switch (field.kind) {
    case FieldKind::constant:
      reader.vector("force_n", field.force, kForce, Presence::required);
      return;
    case FieldKind::spring:
      reader.vector("centre_m", field.centre, kPoint, Presence::required);
      reader.number("radius_m", field.radius, kRadius);
      reader.number("stiffness_n_per_m", field.stiffness, kStiffness, Presence::required);
      return;
    case FieldKind::channel:
      reader.vector("from_m", field.centre, kPoint, Presence::required);
      reader.vector("to_m", field.to, kPoint, Presence::required);
      reader.number("half_width_m", field.radius, kRadius, Presence::required);
      reader.number("stiffness_n_per_m", field.stiffness, kStiffness, Presence::required);
      if (reader.has("from_m") && reader.has("to_m") &&
          !(glm::distance(field.centre, field.to) >= 1e-6))
        reader.faults().add(reader.pointer("to_m"),
                            "expected another point than from_m, at least 1e-6 m from it");
      return;
    case FieldKind::viscous:
      read_matrix(reader, field.damping);
      reader.boolean("destabilising", field.destabilising);
      reader.number("low_pass_s", field.low_pass, kLowPass);
      if (!field.destabilising && !dissipates(field.damping))
        reader.faults().add(
            reader.pointer("damping_ns_per_m"),
            "expected a matrix B with no negative eigenvalue of B + B^T: this field would feed "
            "energy; \"destabilising\": true allows it, on record");
      return;
    case FieldKind::curl: {
      double damping = 0;
      reader.number("damping_ns_per_m", damping, kDamping, Presence::required);
      field.damping = Mat3(damping);
      read_direction(reader, "axis", field.axis, Presence::required);
      reader.boolean("destabilising", field.destabilising);
      reader.number("low_pass_s", field.low_pass, kLowPass);
      return;
    }
    case FieldKind::vibration:
      reader.number("amplitude_n", field.amplitude, kAmplitude, Presence::required);
      reader.number("frequency_hz", field.frequency, kFrequency, Presence::required);
      read_direction(reader, "direction", field.axis, Presence::required);
      reader.choice("while", field.always, {{"contact", false}, {"always", true}});
      return;
  }
}

void read_fields(ObjectReader& reader, stimuli::ObjectSpec& spec) {
  const json* const list = reader.array("fields", 0, kMostFields);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("fields"), i), reader.faults());
    stimuli::FieldSpec field;
    const std::size_t before = reader.faults().count();
    item.choice("kind", field.kind,
                {{"constant", FieldKind::constant},
                 {"spring", FieldKind::spring},
                 {"channel", FieldKind::channel},
                 {"viscous", FieldKind::viscous},
                 {"curl", FieldKind::curl},
                 {"vibration", FieldKind::vibration}},
                Presence::required);
    if (reader.faults().count() != before) continue;
    item.choice("at", field.at_grip, {{"tip", false}, {"grip", true}});
    read_field_keys(item, field);
    item.refuse_unknown_keys();
    spec.fields.push_back(field);
  }
}

}  // namespace

void read_effects(ObjectReader& reader, const MeshFiles& files, stimuli::ObjectSpec& spec) {
  read_texture(reader, files, spec);
  read_fields(reader, spec);
  reader.section("contact_transient", [&](ObjectReader& section) {
    stimuli::TransientSpec& read = spec.transient.emplace();
    section.number("amplitude_ns_per_m", read.amplitude, kKnock);
    section.number("frequency_hz", read.frequency, kKnockFrequency);
    section.number("decay_s", read.decay, kDecay);
  });
  if (spec.shape != stimuli::ShapeKind::none) return;
  const json* const fields = reader.member("fields");
  if (fields == nullptr || (fields->is_array() && fields->empty()))
    reader.faults().add(reader.pointer("fields"),
                        "expected one or more fields: shape 'none' has nothing else to feel");
  for (const char* key : {"contact_transient", "body", "layers"}) {
    if (reader.has(key))
      reader.faults().add(reader.pointer(key), "expected an object with a surface");
  }
}

void refuse_effects_of_part(ObjectReader& part) {
  for (const char* key : {"texture", "fields", "contact_transient"}) {
    if (part.member(key) != nullptr)
      part.faults().add(part.pointer(key), "expected at the object, not at a part of a compound");
  }
}

}  // namespace palpate::protocols
