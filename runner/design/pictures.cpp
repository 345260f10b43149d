#include "runner/design/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "data/base/cell_name.h"
#include "data/base/json_text.h"
#include "protocols/parse.h"
#include "protocols/tasks/levels.h"
#include "runner/design/surface_marks.h"
#include "runner/scene_builder.h"
#include "runner/touch/trial_page.h"

namespace palpate::runner::design {
namespace {

using Json = nlohmann::ordered_json;
using protocols::Protocol;
using protocols::StimulusSpec;
using protocols::TaskBlock;

constexpr std::size_t kMostTriangles = 12000;  // of all stimuli together

Json as_json(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

void put_mesh(const touch::PictureMesh& mesh, Json& out) {
  out["corners"] = Json::array();
  Vec3 low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
  for (const Vec3& corner : mesh.corners) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
    out["corners"].push_back(as_json(corner));
  }
  out["triangles"] = mesh.triangles;
  out["size_m"] = as_json(high - low);
}

/// "/fields/0" as a picture needs it.
Json as_json(const stimuli::FieldSpec& field) {
  using Kind = stimuli::FieldSpec::Kind;
  constexpr std::array kNames = {"constant", "spring", "channel", "viscous", "curl", "vibration"};
  Json out{{"kind", kNames[static_cast<std::size_t>(field.kind)]}};
  switch (field.kind) {
    case Kind::constant:
      out["force_n"] = as_json(field.force);
      break;
    case Kind::channel:
      out["to_m"] = as_json(field.to);
      [[fallthrough]];
    case Kind::spring:
      out["centre_m"] = as_json(field.centre);
      out["radius_m"] = field.radius;
      break;
    case Kind::curl:
      out["turns"] = field.damping[0][0] < 0 ? -1 : field.damping[0][0] > 0 ? 1 : 0;
      [[fallthrough]];
    case Kind::vibration:
      out["axis"] = as_json(field.axis);
      break;
    case Kind::viscous:
      out["resists"] = field.damping != decltype(field.damping){};
      break;
  }
  return out;
}

Json marks_of(const stimuli::ObjectSpec& object, const touch::PictureMesh& mesh) {
  SceneBuilder builder;
  const auto texture = builder.texture_of(object);
  if (!texture) return nullptr;
  const SurfaceMarks marks = surface_marks(object, *texture, mesh.corners, mesh.triangles);
  Json out{{"every", marks.every}, {"lines", Json::array()}, {"dots", Json::array()}};
  for (const auto& [from, to] : marks.lines) out["lines"].push_back({as_json(from), as_json(to)});
  for (const Vec3& dot : marks.dots) out["dots"].push_back(as_json(dot));
  return out;
}

/// Surfaces that were made already: most levels, cells and groups have the shape of another.
class Surfaces {
 public:
  explicit Surfaces(std::size_t most_triangles) : most_(most_triangles) {}

  const touch::PictureMesh& of(const stimuli::ObjectSpec& object) {
    const std::string shape = shape_of(object).dump();
    const auto known = surfaces_.find(shape);
    if (known != surfaces_.end()) return known->second;
    return surfaces_.emplace(shape, touch::picture_mesh(object, most_)).first->second;
  }

 private:
  /// The keys that decide on a surface.
  static Json shape_of(const stimuli::ObjectSpec& object) {
    Json out{static_cast<int>(object.shape),
             object.radius,
             object.height,
             object.edge,
             object.subdivisions,
             object.segments,
             object.file,
             object.scale,
             object.soft.has_value(),
             {object.size.x, object.size.y, object.size.z}};
    for (const stimuli::ObjectSpec& part : object.parts) {
      const Vec3& at = part.pose.position;
      const Quat& turn = part.pose.orientation;
      out.push_back({at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z});
      out.push_back(shape_of(part));
    }
    return out;
  }

  std::size_t most_;  // triangles of each
  std::map<std::string, touch::PictureMesh> surfaces_;
};

/// The seen object, if it differs from the felt one; null: it does not.
Json seen_of(const StimulusSpec& stimulus, Surfaces& surfaces) {
  if (!stimulus.seen || !stimulus.seen->object) return nullptr;
  const protocols::SeenSpec& seen = *stimulus.seen;
  const bool moved = seen.size_ratio != 1 || seen.turn_deg != 0 || seen.offset != Vec3(0);
  if (!seen.shape && !moved && stimulus.felt) return nullptr;
  const stimuli::ObjectSpec& object = seen.shape ? *seen.shape : stimulus.object;
  if (object.shape == stimuli::ShapeKind::none) return nullptr;
  touch::PictureMesh mesh = surfaces.of(object);
  const Quat turn = glm::angleAxis(glm::radians(seen.turn_deg), seen.axis);
  for (Vec3& corner : mesh.corners) corner = turn * (seen.size_ratio * corner);
  Json out;
  put_mesh(mesh, out);
  return out;
}

Json picture_of(const stimuli::ObjectSpec& object, Surfaces& surfaces) {
  Json out{{"corners", Json::array()}, {"triangles", Json::array()}};
  for (const stimuli::FieldSpec& field : object.fields) out["fields"].push_back(as_json(field));
  if (object.shape == stimuli::ShapeKind::none) return out;
  const touch::PictureMesh& mesh = surfaces.of(object);
  put_mesh(mesh, out);
  if (Json marks = marks_of(object, mesh); !marks.is_null()) out["marks"] = std::move(marks);
  // Primitives look the same with fewer.
  if (object.shape == stimuli::ShapeKind::mesh && mesh.all_triangles > mesh.triangles.size())
    out["all_triangles"] = mesh.all_triangles;
  return out;
}

// ---- what the levels of a block make of a stimulus ----

using Points = std::vector<protocols::LevelPoint>;

/// Those with the least and the greatest of each number, ascending.
Points ends_of(const Points& points) {
  Points ends;
  for (std::size_t d = 0; !points.empty() && d < points.front().size(); ++d) {
    const auto less = [d](const auto& a, const auto& b) {
      return std::pair(a[d], a) < std::pair(b[d], b);
    };
    const auto [least, greatest] = std::ranges::minmax_element(points, less);
    ends.insert(ends.end(), {*least, *greatest});
  }
  std::ranges::sort(ends);
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

Points ends_of(const TaskBlock& block) {
  Points points = protocols::points_of(block);
  for (const double level : protocols::levels_of(block)) points.push_back({level});
  return ends_of(points);
}

/// The numbers that a block varies of its stimuli, or of its standards: places in a point.
std::vector<std::size_t> varied_numbers(const TaskBlock& block, bool standard) {
  if (block.level) return standard ? std::vector<std::size_t>{} : std::vector<std::size_t>{0};
  std::vector<std::size_t> out;
  for (std::size_t d = 0; d < block.dimensions.size(); ++d)
    if (block.dimensions[d].applies_to(standard)) out.push_back(d);
  return out;
}

/// {"name": of the dimension, "path"}
Json number_of(const TaskBlock& block, std::size_t d) {
  if (block.level) return {{"path", block.level->pointer}};
  return {{"name", block.dimensions[d].name}, {"path", block.dimensions[d].target.pointer}};
}

Json range_of(const TaskBlock& block, bool standard, const Points& ends) {
  Json out = Json::array();
  for (const std::size_t d : varied_numbers(block, standard)) {
    const auto by_number = [d](const auto& point) { return point[d]; };
    const auto [least, greatest] = std::ranges::minmax(ends, {}, by_number);
    Json& number = out.emplace_back(number_of(block, d));
    number["least"] = least[d];
    number["most"] = greatest[d];
  }
  return out;
}

/// A stimulus as blocks show it that vary the same numbers of it.
struct VariedStimulus {
  const TaskBlock* block;  ///< the first of them
  bool standard;
  Points points{};

  bool has_numbers_of(const TaskBlock& other) const {
    return block->level == other.level && block->dimensions == other.dimensions;
  }
  StimulusSpec at(const Protocol& protocol, int stimulus,
                  const protocols::LevelPoint& point) const {
    return block->level ? protocols::at_level(protocol, *block, stimulus, point.front())
                        : protocols::at_point(protocol, *block, stimulus, point, standard);
  }
};

// ---- all that is drawn ----

/// The pictures of one protocol and of its groups, each look once.
class Pictures {
 public:
  explicit Pictures(std::size_t most_triangles) : surfaces_(most_triangles) {}

  /// \param group  "": of all participants
  void add(const Protocol& protocol, const std::string& group) {
    std::set<int> channels;  // of a reach: they have no place of their own
    for (const TaskBlock& block : protocol.blocks)
      if (block.reaching)
        channels.insert(block.reaching->channels.begin(), block.reaching->channels.end());
    std::vector<Points> ends;
    for (const TaskBlock& block : protocol.blocks) ends.push_back(ends_of(block));
    for (int i = 0; i < static_cast<int>(protocol.stimuli.size()); ++i) {
      if (channels.contains(i)) continue;
      add_stimulus(protocol, i, group);
      add_levels(protocol, i, ends, group);
    }
  }

  /// The varied numbers stand with the first picture of a name.
  Json all() {
    for (Json& picture : pictures_) {
      const auto varied = varied_.find(picture["name"].get<std::string>());
      if (varied == varied_.end()) continue;
      picture["varied"] = std::move(varied->second);
      varied_.erase(varied);
    }
    return std::move(pictures_);
  }

 private:
  /// nullopt: what looks like it is there already.
  Json* add_look(const StimulusSpec& stimulus, const std::string& base, const Quat& turn,
                 bool always) {
    Json picture = picture_of(stimulus.object, surfaces_);
    if (Json seen = seen_of(stimulus, surfaces_); !seen.is_null())
      picture["seen"] = std::move(seen);
    if (std::abs(turn.w) < 1 - 1e-12) picture["turn_wxyz"] = {turn.w, turn.x, turn.y, turn.z};
    const bool is_new = looks_.insert(base + picture.dump()).second;
    if (!is_new && !always) return nullptr;
    Json& added = pictures_.emplace_back(Json{{"name", stimulus.name}});
    added.update(picture);
    return &added;
  }

  void add_stimulus(const Protocol& protocol, int index, const std::string& group) {
    const StimulusSpec& stimulus = protocol.stimuli[static_cast<std::size_t>(index)];
    const std::string base = base_name(stimulus.name);
    // A stimulus in a cell that looks like one that is shown already is left out.
    Json* const added =
        add_look(stimulus, base, Quat(1, 0, 0, 0), group.empty() && base == stimulus.name);
    if (added == nullptr) return;
    if (!group.empty()) (*added)["group"] = group;
    const bool as_in_file = group.empty() && base == stimulus.name;
    if (!as_in_file)  // only version 2 has cells and groups
      (*added)["written"] =
          read_ordered_json(protocol.stimulus_texts[static_cast<std::size_t>(index)]);
  }

  void add_levels(const Protocol& protocol, int index, const std::vector<Points>& ends_of_blocks,
                  const std::string& group) {
    const StimulusSpec& own = protocol.stimuli[static_cast<std::size_t>(index)];
    std::vector<VariedStimulus> all;
    for (std::size_t b = 0; b < protocol.blocks.size(); ++b) {
      const TaskBlock& block = protocol.blocks[b];
      const Points& ends = ends_of_blocks[b];
      for (const bool standard : {false, true}) {
        const std::vector<int> stimuli = protocols::varied_stimuli(block, standard);
        if (std::ranges::find(stimuli, index) == stimuli.end()) continue;
        if (ends.empty() || varied_numbers(block, standard).empty()) continue;
        add_range(own.name, block.name, group, range_of(block, standard, ends));
        auto known = std::ranges::find_if(all, [&](const VariedStimulus& one) {
          return one.standard == standard && one.has_numbers_of(block);
        });
        if (known == all.end()) known = all.insert(known, {&block, standard});
        known->points.insert(known->points.end(), ends.begin(), ends.end());
      }
    }
    for (const VariedStimulus& varied : all)
      for (const protocols::LevelPoint& end : ends_of(varied.points))
        add_end(own, varied.at(protocol, index, end), varied, end, group);
  }

  void add_end(const StimulusSpec& own, const StimulusSpec& shown, const VariedStimulus& varied,
               const protocols::LevelPoint& end, const std::string& group) {
    const Quat turn = shown.object.pose.orientation * glm::conjugate(own.object.pose.orientation);
    Json* const added = add_look(shown, base_name(own.name), turn, false);
    if (added == nullptr) return;
    (*added)["name"] = own.name;
    if (!group.empty()) (*added)["group"] = group;
    for (const std::size_t d : varied_numbers(*varied.block, varied.standard)) {
      Json& number = (*added)["at"].emplace_back(number_of(*varied.block, d));
      number["value"] = end[d];
    }
  }

  /// Once for what a group varies as all do.
  void add_range(const std::string& stimulus, const std::string& block, const std::string& group,
                 const Json& numbers) {
    Json& ranges = varied_[stimulus];
    for (const Json& known : ranges)
      if (known["block"] == block && known["numbers"] == numbers) return;
    Json& range = ranges.emplace_back(Json{{"block", block}});
    if (!group.empty()) range["group"] = group;
    range["numbers"] = numbers;
  }

  Surfaces surfaces_;
  Json pictures_ = Json::array();
  std::set<std::string> looks_;
  std::map<std::string, Json> varied_;  // by stimulus
};

/// The movements of blocks of reaches, each place once.
Json movements_of(const Protocol& protocol) {
  Json out = Json::array();
  for (const TaskBlock& block : protocol.blocks) {
    if (!block.reaching) continue;
    const protocols::ReachingSpec& reaching = *block.reaching;
    Json places{{"home_m", as_json(reaching.home)},
                {"home_radius_m", reaching.home_radius},
                {"targets_m", Json::array()},
                {"target_radius_m", reaching.target_radius}};
    for (const Vec3& target : reaching.targets) places["targets_m"].push_back(as_json(target));
    auto known = std::find_if(out.begin(), out.end(),
                              [&](const Json& one) { return one["places"] == places; });
    if (known == out.end()) {
      out.push_back({{"blocks", Json::array()}, {"places", places}});
      known = std::prev(out.end());
    }
    Json& blocks = (*known)["blocks"];  // cells of one have one name
    if (std::find(blocks.begin(), blocks.end(), block.name) == blocks.end())
      blocks.push_back(block.name);
  }
  return out;
}

}  // namespace

Json picture_answer(const std::string& text, const std::string& path) {
  const Protocol protocol = protocols::parse_protocol_text(text, path);
  Pictures pictures(kMostTriangles / protocol.stimuli.size() + 1);
  pictures.add(protocol, "");
  for (std::size_t i = 0; i < protocol.group_protocols.size(); ++i)
    pictures.add(*protocol.group_protocols[i], protocol.groups.true_name(i));
  Json out{{"stimuli", pictures.all()}, {"movements", movements_of(protocol)}};
  Json& stylus = out["stylus"];
  stylus = {{"length_m", protocol.stylus.length}, {"grip_m", protocol.stylus.grip}};
  for (const protocols::ToolSegmentSpec& segment : protocol.tool.segments)
    stylus["segments"].push_back({as_json(segment.from), as_json(segment.to)});
  if (protocol.reach) stylus["reach"] = protocol.reach->factor;
  return out;
}

}  // namespace palpate::runner::design
