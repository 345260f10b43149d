#include "protocols/parse_soft.h"

#include <string>

#include "stimuli/shapes.h"
#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::protocols {
namespace {

// What the coupling of the body's steps with the servo was found stable over (rendering/README.md).
constexpr NumberRange kYoung{1e3, 1e7, "Pa"};
constexpr NumberRange kSpring{200, 3000, "N/m, on a soft object"};
constexpr NumberRange kPoisson{0, 0.495};
constexpr NumberRange kSoftDensity{100, 20000, "kg/m^3"};
constexpr NumberRange kStrainDamping{0, 1, "s"};
constexpr NumberRange kResolution{stimuli::kLeastResolution, stimuli::kMostResolution};
constexpr NumberRange kPoint{-1000, 1000, "m"};
constexpr std::size_t kMostPoints = 1000;

bool can_be_soft(const stimuli::ObjectSpec& spec) {
  switch (spec.shape) {
    case stimuli::ShapeKind::cube:
    case stimuli::ShapeKind::box:
    case stimuli::ShapeKind::sphere:
    case stimuli::ShapeKind::cylinder:
      return true;
    case stimuli::ShapeKind::mesh:
      return stimuli::is_gmsh_file_name(spec.file);
    case stimuli::ShapeKind::cone:
    case stimuli::ShapeKind::compound:
      return false;
  }
  return false;
}

void read_fixed(ObjectReader& reader, stimuli::Soft& soft) {
  const nlohmann::json* const value = reader.member("fixed");
  if (value == nullptr) return;
  if (!value->is_array()) {
    read_choice(*value, reader.pointer("fixed"), soft.fixed,
                {{"base", stimuli::Soft::Fixed::base}, {"none", stimuli::Soft::Fixed::none}},
                reader.faults());
    return;
  }
  soft.fixed = stimuli::Soft::Fixed::points;
  const nlohmann::json* const list = reader.array("fixed", 1, kMostPoints);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("fixed"), i);
    const nlohmann::json& point = (*list)[i];
    Vec3 read(0);
    if (!point.is_array() || point.size() != 3) {
      reader.faults().add(pointer,
                          "expected [x, y, z], m, in the object's frame" + found_text(point));
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      const auto k = static_cast<std::size_t>(c);
      read_number(point[k], child_pointer(pointer, k), read[c], kPoint, reader.faults());
    }
    soft.points.push_back(read);
  }
}

void refuse_with(ObjectReader& reader, bool has, const char* key, const char* why) {
  if (has) reader.faults().add(reader.pointer(key), why);
}

}  // namespace

void read_soft(ObjectReader& reader, stimuli::ObjectSpec& spec) {
  const bool is_gmsh =
      spec.shape == stimuli::ShapeKind::mesh && stimuli::is_gmsh_file_name(spec.file);
  if (reader.member("soft") == nullptr) {
    refuse_with(reader, is_gmsh, "file",
                "expected the key 'soft' beside a .msh file: its tetrahedra are for what gives");
    return;
  }
  stimuli::Soft& soft = spec.soft.emplace();
  reader.section("soft", [&](ObjectReader& section) {
    section.number("young_pa", soft.young, kYoung, Presence::required);
    section.number("poisson", soft.poisson, kPoisson);
    section.number("density_kg_per_m3", soft.density, kSoftDensity);
    section.number("damping_s", soft.damping, kStrainDamping);
    read_fixed(section, soft);
    soft.resolution = 0;  // the highest that can be stepped
    section.integer("resolution", soft.resolution, kResolution);
    refuse_with(section, is_gmsh && section.has("resolution"), "resolution",
                "expected none: a .msh file brings its elements");
  });
  if (!can_be_soft(spec)) {
    reader.faults().add(
        reader.pointer("soft"),
        "expected a cube, box, sphere, cylinder or a mesh with a .msh file; found " +
            std::string(stimuli::traits_of(spec.shape).name));
  }
  if (!(spec.material.stiffness >= kSpring.min && spec.material.stiffness <= kSpring.max)) {
    reader.faults().add(reader.pointer("stiffness_n_per_m"),
                        "expected 200 to 3000 N/m on a soft object, the spring between tool and "
                        "surface: there its coupling was found stable");
  }
  refuse_with(reader, spec.body.has_value(), "body",
              "expected body or soft, not both: a soft object moves by itself with fixed: none");
  refuse_with(reader, spec.material.has_friction(), "friction_static",
              "expected none on a soft object: friction on what gives is not rendered");
  refuse_with(reader, spec.material.damping > 0, "damping_ns_per_m",
              "expected none on a soft object: its damping is soft/damping_s");
  refuse_with(reader, !spec.material.layers.empty(), "layers", "expected none on a soft object");
}

}  // namespace palpate::protocols
