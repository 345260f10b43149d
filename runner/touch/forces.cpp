#include "runner/touch/forces.h"

#include <array>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <stdexcept>

#include "analysis/input/csv_reader.h"
#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "protocols/scene_spec.h"
#include "runner/scene_builder.h"
#include "runner/usage_error.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::touch {
namespace {

constexpr std::size_t kFaultsShown = 20;
analysis::CsvReader open(const std::string& path) {
  try {
    return analysis::CsvReader(path);
  } catch (const std::runtime_error& error) {
    throw protocols::InputError(
        {{path, "(file)", std::string("expected a readable file: ") + error.what()}});
  }
}

std::string joined(const std::vector<std::string_view>& fields) {
  std::string line;
  for (const std::string_view field : fields) {
    if (!line.empty()) line += ',';
    line += field;
  }
  return line;
}

constexpr std::size_t kPoseColumns = 7, kSideColumns = 3;

/// The numbers of a row, zero beyond the first `count`. Empty if the row has anything else.
std::optional<std::array<double, kPoseColumns + kSideColumns>> numbers_of(
    const std::vector<std::string_view>& fields, std::size_t count) {
  std::array<double, kPoseColumns + kSideColumns> out{};
  if (fields.size() != count) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) {
    const char* const end = fields[i].data() + fields[i].size();
    const auto [stop, error] = std::from_chars(fields[i].data(), end, out[i]);
    if (error != std::errc{} || stop != end) return std::nullopt;
  }
  return out;
}

rendering::Reach reach_for(const protocols::ReachSpec& spec, const rendering::LineProbe& real) {
  constexpr double kGrip = protocols::Protocol::Stylus{}.grip;  // as where a protocol does not say
  return reach_of(spec, glm::distance(real.tip, real.tail), kGrip);
}

/// One tick of a stylus with an extended reach.
rendering::Rendering extended_tick(const rendering::Scene& scene, rendering::RenderState& state,
                                   const rendering::Renderer& renderer,
                                   const protocols::ReachSpec& spec,
                                   const rendering::LineProbe& real, double dt) {
  const rendering::Reach reach = reach_for(spec, real);
  return felt(reach, renderer.tick(scene, state, stretched(reach, real), dt));
}

}  // namespace

std::string fault_of(const TimedPose& pose, const std::vector<TimedPose>& before) {
  if (!std::isfinite(pose.t)) return "expected a finite time";
  if (!before.empty() && pose.t <= before.back().t)
    return "expected a time later than the one before";
  if (before.size() == kMostPoses)
    return "expected at most " + std::to_string(kMostPoses) +
           " rows; split the path into several files";
  return "";
}

std::vector<TimedPose> read_trajectory(const std::string& path) {
  analysis::CsvReader reader = open(path);
  std::vector<TimedPose> poses;
  std::vector<protocols::Fault> faults;
  std::size_t columns = 0;  // known from the header on
  while (faults.size() < kFaultsShown && reader.next()) {
    const std::string place = "line " + std::to_string(reader.line());
    if (!reader.fault().empty()) {
      faults.push_back({path, place, reader.fault()});
      continue;
    }
    if (columns == 0) {
      const std::string header = joined(reader.fields());
      const bool sides = header == std::string(kTrajectoryHeader) + kSideHeader;
      if (header != kTrajectoryHeader && !sides) {
        throw protocols::InputError(
            {{path, place,
              std::string("expected the header ") + kTrajectoryHeader +
                  (header.find("side") == std::string::npos
                       ? ""
                       : std::string(", with or without ") + kSideHeader + " after it")}});
      }
      columns = kPoseColumns + (sides ? kSideColumns : 0);
      continue;
    }
    const auto values = numbers_of(reader.fields(), columns);
    if (!values) {
      faults.push_back(
          {path, place,
           columns == kPoseColumns ? "expected seven numbers" : "expected ten numbers"});
      continue;
    }
    const auto& v = *values;
    const TimedPose pose{
        v[0], {{v[1], v[2], v[3]}, {v[4], v[5], v[6]}}, {v[7], v[8], v[9]}, reader.line()};
    if (const std::string fault = fault_of(pose, poses); !fault.empty()) {
      faults.push_back({path, place, fault});
      if (poses.size() == kMostPoses) break;
    } else {
      poses.push_back(pose);
    }
  }
  if (faults.size() == kFaultsShown) {
    faults.push_back({path, "further lines", "possibly more faults; only the first are shown"});
  } else if (!reader.fault().empty()) {
    faults.push_back({path, "line " + std::to_string(reader.line()), reader.fault()});
  }
  if (!faults.empty()) throw protocols::InputError(std::move(faults));
  if (poses.empty()) throw protocols::InputError({{path, "(file)", "expected at least one row"}});
  return poses;
}

std::vector<std::string> force_columns(bool tool) {
  std::vector<std::string> names{"t"};
  const auto add = [&names](const char* vector) {
    for (const char* axis : {"_x", "_y", "_z"}) names.push_back(std::string(vector) + axis);
  };
  for (const char* vector :
       {"force", "torque", "ideal_tip", "ideal_tail", "contact", "device1", "device2"})
    add(vector);
  names.insert(names.end(), {"depth", "contacts", "contact_type", "object"});
  if (tool) {
    names.emplace_back("segment");
    add("ideal_side");
  }
  names.emplace_back("faults");
  return names;
}

std::string names_of(std::uint32_t faults) {
  std::string names;
  for (const rendering::FaultBit& fault : rendering::kRenderFaults) {
    if ((faults & fault.bit) != 0) (names += names.empty() ? "" : "+") += fault.name;
  }
  return names;
}

ForceTable::ForceTable(bool tool)
    : tool_(tool), csv_(force_columns(tool), "\n"), seen_(rendering::kRenderFaults.size()) {}

void ForceTable::add(const TimedPose& pose, const rendering::Rendering& r) {
  ++rows_;
  put_forces(csv_, pose.t, r, tool_);
  for (std::size_t i = 0; i < rendering::kRenderFaults.size(); ++i) {
    if ((r.faults & rendering::kRenderFaults[i].bit) == 0) continue;
    if (seen_[i].ticks++ == 0) seen_[i].first_line = pose.line;
  }
}

std::string ForceTable::warnings(const std::string& path) const {
  std::string out;
  for (std::size_t i = 0; i < rendering::kRenderFaults.size(); ++i) {
    if (seen_[i].ticks == 0) continue;
    out += path + ": warning: " + rendering::kRenderFaults[i].name + " in " +
           std::to_string(seen_[i].ticks) + " of " + std::to_string(rows_) +
           " rows, first on line " + std::to_string(seen_[i].first_line) + " (" +
           rendering::kRenderFaults[i].meaning + "); see the column 'faults'\n";
  }
  return out;
}

BodyTable::BodyTable()
    : csv_(std::array{"t", "object", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx",
                      "wy", "wz"},
           "\n") {}

void BodyTable::add(double t, std::span<const rendering::BodyPose> bodies) {
  const auto put = [this](const Vec3& v) { csv_ << v.x << v.y << v.z; };
  for (const rendering::BodyPose& body : bodies) {
    csv_ << t << body.object;
    put(body.centre);
    csv_ << body.orientation.w << body.orientation.x << body.orientation.y << body.orientation.z;
    put(body.velocity);
    put(body.spin);
    csv_.end_row();
  }
}

const rendering::Renderer& renderer_named(const std::string& name) {
  if (name != "point" && name != "ray")
    throw UsageError("--renderer: must be point or ray, not '" + name + "'");
  return renderer_for(name == "ray" ? protocols::RendererKind::ray
                                    : protocols::RendererKind::point);
}

rendering::Scene build_scene(SceneBuilder& builder, const std::string& path,
                             const protocols::SceneSpec& spec,
                             const rendering::Renderer& renderer) {
  try {
    return builder.build(spec.objects, renderer.side_contact(), tool_of(spec.tool), spec.gravity,
                         spec.tool.radius > 0 ? spec.tool.radius : protocols::kSoftRadius);
  } catch (const stimuli::MeshError& error) {
    std::vector<std::string> faults;
    for (const std::string& fault : error.faults()) {
      faults.push_back(std::string(path).append(": ").append(fault));
    }
    throw stimuli::MeshError(std::move(faults));
  }
}

void render_along(const rendering::Scene& scene, const protocols::SceneSpec& spec,
                  const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                  const TickVisitor& visit) {
  rendering::RenderState state = scene.initial_state();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double dt = i > 0 ? poses[i].t - poses[i - 1].t : 0;
    state.measured_side = poses[i].side;
    const rendering::Rendering rendering =
        spec.reach ? extended_tick(scene, state, renderer, *spec.reach, poses[i].probe, dt)
                   : renderer.tick(scene, state, poses[i].probe, dt);
    visit(poses[i], rendering, state);
  }
}

rendering::LineProbe virtual_stylus(const protocols::SceneSpec& spec,
                                    const rendering::LineProbe& real) {
  return spec.reach ? stretched(reach_for(*spec.reach, real), real) : real;
}

}  // namespace palpate::runner::touch
