#include "protocols/parse_sight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "protocols/tasks/levels.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr NumberRange kStationPlace{-10, 10, "m"};
constexpr NumberRange kEyes{0, 0.08, "m"};
constexpr NumberRange kLuminance{0, 1};
constexpr NumberRange kSizeRatio{0.5, 2};
constexpr NumberRange kSeenShift{-1, 1, "m"};
constexpr NumberRange kSeenTurn{-360, 360, "degrees"};
constexpr NumberRange kTurnAxis{-1e3, 1e3};
constexpr NumberRange kToolGain{0.2, 5};
constexpr NumberRange kGive{1, 1e6, "N/m"};
constexpr NumberRange kSeenDelay{0, 1, "s"};
constexpr NumberRange kBlur{0, 5, "degrees"};
constexpr NumberRange kSeenNoise{0, 0.1, "m"};
constexpr NumberRange kSeenNoiseRate{0.1, 60, "Hz"};
constexpr double kLeastSide = 0.01;         // m, of a screen
constexpr double kMostSkew = 0.02;          // cosine of the angle between its sides
constexpr double kLeastEyeDistance = 0.05;  // m

constexpr const char* kSizeConflict = "/seen/size_ratio";
constexpr const char* kGiveConflict = "/seen/give_stiffness_n_per_m";

void read_unit(ObjectReader& reader, const char* key, Vec3& out) {
  Vec3 read = out;
  reader.vector(key, read, kTurnAxis);
  if (!reader.has(key)) return;
  if (const double length = glm::length(read); length > 0) {
    out = read / length;
  } else {
    reader.faults().add(reader.pointer(key), "expected a direction that is not zero");
  }
}

void read_what(ObjectReader& section, SeenSpec& seen) {
  const json* const value = section.member("what", Presence::required);
  if (value == nullptr) return;
  enum class What { nothing, object, tool, picture };
  const auto take = [&](const json& word, const std::string& pointer) {
    What what{};
    if (!read_choice(word, pointer, what,
                     {{"nothing", What::nothing},
                      {"object", What::object},
                      {"tool", What::tool},
                      {"picture", What::picture}},
                     section.faults()))
      return;
    seen.object |= what == What::object;
    seen.tool |= what == What::tool;
    seen.picture |= what == What::picture;
  };
  if (value->is_string()) return take(*value, section.pointer("what"));
  const json* const list = section.array("what", 1, 3);
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i)
    take((*list)[i], child_pointer(section.pointer("what"), i));
}

void read_seen_picture(ObjectReader& section, const MeshFiles& files, SeenSpec& seen) {
  section.text("picture", seen.file_name);
  if (seen.picture && seen.file_name.empty())
    section.faults().add(section.pointer("picture"), "missing; what is seen is a picture");
  if (seen.file_name.empty()) return;
  if (!seen.picture)
    section.faults().add(section.pointer("picture"), "expected 'picture' in 'what' as well");
  seen.file_bytes = read_kept_file(section, "picture", "PNG file", files);
  constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";
  if (seen.file_bytes && !seen.file_bytes->starts_with(kPng))
    section.faults().add(section.pointer("picture"), "expected a PNG file");
}

/// Another shape to be seen, with the keys of an object's form.
void read_shape(ObjectReader& section, const MeshFiles& files, SeenSpec& seen) {
  if (!section.has("shape")) return;
  auto shape =
      std::make_shared<stimuli::ObjectSpec>(read_object(section, stimuli::Material{}, files));
  for (const char* key :
       {"stiffness_n_per_m", "damping_ns_per_m", "friction_static", "friction_dynamic", "layers",
        "body", "soft", "texture", "fields", "contact_transient"}) {
    if (section.has(key))
      section.faults().add(section.pointer(key),
                           "expected at the stimulus: this shape is not felt");
  }
  if (shape->shape == stimuli::ShapeKind::none)
    section.faults().add(section.pointer("shape"), "expected a shape that can be seen");
  seen.shape = std::move(shape);
}

void read_seen_keys(ObjectReader& section, const MeshFiles& files, SeenSpec& seen) {
  read_what(section, seen);
  section.choice("when", seen.when,
                 {{"forces", SeenSpec::When::forces},
                  {"contact", SeenSpec::When::contact},
                  {"before", SeenSpec::When::before},
                  {"always", SeenSpec::When::always}});
  section.number("size_ratio", seen.size_ratio, kSizeRatio);
  section.vector("offset_m", seen.offset, kSeenShift);
  section.number("turn_deg", seen.turn_deg, kSeenTurn);
  read_unit(section, "axis", seen.axis);
  section.vector("tool_offset_m", seen.tool_offset, kSeenShift);
  section.number("tool_gain", seen.tool_gain, kToolGain);
  section.choice("tool_place", seen.tool_stops, {{"ideal", true}, {"virtual", false}});
  if (const json* const give = section.member("give_stiffness_n_per_m")) {
    if (give->is_string()) {
      section.choice("give_stiffness_n_per_m", seen.gives_as_felt, {{"felt", true}});
    } else {
      double stiffness = 0;
      section.number("give_stiffness_n_per_m", stiffness, kGive);
      seen.give_stiffness = stiffness;
    }
  }
  section.number("delay_s", seen.delay, kSeenDelay);
  section.number("blur_deg", seen.blur_deg, kBlur);
  section.number("noise_m", seen.noise, kSeenNoise);
  section.number("noise_hz", seen.noise_hz, kSeenNoiseRate);
  read_shape(section, files, seen);
  read_seen_picture(section, files, seen);
}

void read_corners(ObjectReader& section, ViewSpec& view) {
  const json* const list = section.array("screen_m", 3, 3, Presence::required);
  if (list == nullptr) return;
  const std::array<Vec3*, 3> corners{&view.lower_left, &view.lower_right, &view.upper_left};
  const std::size_t before = section.faults().count();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::string pointer = child_pointer(section.pointer("screen_m"), i);
    const json& corner = (*list)[i];
    if (!corner.is_array() || corner.size() != 3) {
      section.faults().add(pointer,
                           "expected [x, y, z], m, in the device's frame" + found_text(corner));
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      const auto k = static_cast<std::size_t>(c);
      read_number(corner[k], child_pointer(pointer, k), (*corners[i])[c], kStationPlace,
                  section.faults());
    }
  }
  if (section.faults().count() > before) return;
  const Vec3 right = view.lower_right - view.lower_left, up = view.upper_left - view.lower_left;
  const double width = glm::length(right), height = glm::length(up);
  if (!(width >= kLeastSide && height >= kLeastSide)) {
    section.faults().add(section.pointer("screen_m"),
                         "expected lower left, lower right and upper left corner of a picture at "
                         "least 0.01 m wide and high");
  } else if (std::abs(glm::dot(right, up)) > kMostSkew * width * height) {
    section.faults().add(section.pointer("screen_m"),
                         "expected corners of a rectangle: lower left, lower right, upper left");
  }
}

void read_view_keys(ObjectReader& section, ViewSpec& view) {
  read_corners(section, view);
  section.vector("eye_m", view.eye, kStationPlace, Presence::required);
  section.number("ipd_m", view.ipd, kEyes);
  section.choice("stereo", view.stereo,
                 {{"none", Stereo::none},
                  {"side_by_side", Stereo::side_by_side},
                  {"top_bottom", Stereo::top_bottom},
                  {"anaglyph", Stereo::anaglyph},
                  {"quad_buffer", Stereo::quad_buffer}});
  section.choice(
      "mirror", view.mirror,
      {{"none", Mirror::none}, {"horizontal", Mirror::horizontal}, {"vertical", Mirror::vertical}});
  section.number("background", view.background, kLuminance);
  section.number("light", view.light, kLuminance);
  section.choice("patch", view.patch,
                 {{"none", PatchPlace::none},
                  {"lower_left", PatchPlace::lower_left},
                  {"lower_right", PatchPlace::lower_right},
                  {"upper_left", PatchPlace::upper_left},
                  {"upper_right", PatchPlace::upper_right}});
  section.choice("lag", view.lag_accepted, {{"limited", false}, {"accepted", true}});
}

void check_view(ObjectReader& section, const ViewSpec& view) {
  const Vec3 normal =
      glm::cross(view.lower_right - view.lower_left, view.upper_left - view.lower_left);
  const double area = glm::length(normal);
  if (!(area > 0)) return;
  const double distance = glm::dot(view.eye - view.lower_left, normal) / area;
  if (!(distance >= kLeastEyeDistance)) {
    section.faults().add(section.pointer("eye_m"),
                         "expected an eye at least 0.05 m in front of the picture, on the side "
                         "from which its corners read lower left, lower right, upper left");
  }
  if (view.stereo != Stereo::none && view.ipd == 0)
    section.faults().add(section.pointer("ipd_m"), "expected more than 0 with stereo");
}

/// The place of a block by its name; none and a fault if there is no such block.
const TaskBlock* block_named(const Protocol& protocol, const std::string& name,
                             const std::string& pointer, FaultList& faults) {
  const auto found = std::ranges::find(protocol.blocks, name, &TaskBlock::name);
  if (found != protocol.blocks.end() && !found->practice) return &*found;
  faults.add(pointer, "expected the name of a block that counts; found '" + name + "'");
  return nullptr;
}

/// A block of a study of cues: two intervals, one factor cell, levels on a standard.
void check_cue_block(const Protocol& protocol, const TaskBlock& block, const std::string& pointer,
                     FaultList& faults) {
  if (block.task != TaskKind::compare || block.intervals != 2 || block.same_different ||
      !block.level || !block.standard) {
    faults.add(pointer,
               "expected a block that compares a level with a standard in two intervals; "
               "'" +
                   block.name + "' does not");
  } else if (!block.factors.empty()) {
    faults.add(pointer, "expected a block without factors; '" + block.name + "' crosses some");
  } else if (!own_level(protocol, block, *block.standard)) {
    faults.add(pointer, "expected a standard with a level of its own; that of '" + block.name +
                            "' has none");
  }
}

const SeenSpec kUnseen{};

const SeenSpec& seen_of(const StimulusSpec& stimulus) {
  return stimulus.seen ? *stimulus.seen : kUnseen;
}

void check_cues(const Protocol& protocol, FaultList& faults) {
  const CuesSpec& cues = *protocol.cues;
  const std::string place = "/cues";
  const auto standard_of = [&](const TaskBlock& block) -> const StimulusSpec& {
    return protocol.stimuli[static_cast<std::size_t>(*block.standard)];
  };
  const std::size_t before = faults.count();
  const TaskBlock* const haptic = block_named(protocol, cues.haptic, place + "/haptic", faults);
  const TaskBlock* const visual = block_named(protocol, cues.visual, place + "/visual", faults);
  std::vector<const TaskBlock*> both;
  for (std::size_t i = 0; i < cues.both.size(); ++i)
    both.push_back(block_named(protocol, cues.both[i], child_pointer(place + "/both", i), faults));
  if (faults.count() > before) return;
  check_cue_block(protocol, *haptic, place + "/haptic", faults);
  check_cue_block(protocol, *visual, place + "/visual", faults);
  for (std::size_t i = 0; i < both.size(); ++i)
    check_cue_block(protocol, *both[i], child_pointer(place + "/both", i), faults);
  if (faults.count() > before) return;
  if (seen_of(standard_of(*haptic)).object)
    faults.add(place + "/haptic", "expected a block whose standard is felt and not seen");
  if (standard_of(*visual).felt || !seen_of(standard_of(*visual)).object)
    faults.add(place + "/visual", "expected a block whose standard is seen and not felt");
  for (std::size_t i = 0; i < both.size(); ++i) {
    const std::string pointer = child_pointer(place + "/both", i);
    const StimulusSpec& standard = standard_of(*both[i]);
    if (!standard.felt || !seen_of(standard).object)
      faults.add(pointer, "expected a block whose standard is seen and felt");
    if (both[i]->level->pointer != haptic->level->pointer)
      faults.add(pointer, "expected the level that the block '" + haptic->name + "' varies: '" +
                              haptic->level->pointer + "'");
    if (cues.conflict == kGiveConflict && !seen_of(standard).give_stiffness)
      faults.add(pointer, "expected a standard with the key give_stiffness_n_per_m of 'seen'");
  }
}

}  // namespace

void read_seen(ObjectReader& reader, const MeshFiles& files, StimulusSpec& stimulus) {
  reader.section("seen", [&](ObjectReader& section) {
    read_seen_keys(section, files, stimulus.seen.emplace());
  });
  reader.boolean("felt", stimulus.felt);
  if (!stimulus.felt && !seen_of(stimulus).anything())
    reader.faults().add(reader.pointer("felt"),
                        "expected true, or something in 'seen': it would be neither seen nor felt");
}

void read_view(ObjectReader& reader, Protocol& protocol) {
  reader.section("view", [&](ObjectReader& section) {
    const std::size_t before = section.faults().count();
    read_view_keys(section, protocol.view.emplace());
    if (section.faults().count() == before) check_view(section, *protocol.view);
  });
  reader.section("cues", [&](ObjectReader& section) {
    CuesSpec& cues = protocol.cues.emplace();
    section.text("haptic", cues.haptic, 200);
    section.text("visual", cues.visual, 200);
    const json* const list = section.array("both", 1, 20, Presence::required);
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
      std::string& name = cues.both.emplace_back();
      read_text((*list)[i], child_pointer(section.pointer("both"), i), name, 200, section.faults());
      if (std::count(cues.both.begin(), cues.both.end(), name) > 1)
        section.faults().add(child_pointer(section.pointer("both"), i), "expected each block once");
    }
    const json* const conflict = section.member("conflict", Presence::required);
    if (conflict != nullptr)
      read_choice<std::string>(*conflict, section.pointer("conflict"), cues.conflict,
                               {{kSizeConflict, kSizeConflict}, {kGiveConflict, kGiveConflict}},
                               section.faults());
  });
}

void check_sight(const Protocol& protocol, FaultList& faults) {
  std::vector<bool> told(protocol.stimuli.size(), false);
  for (const StimulusSpec& stimulus : protocol.stimuli) {
    if (!seen_of(stimulus).anything() || protocol.view || told[stimulus.place]) continue;
    told[stimulus.place] = true;
    faults.add("/stimuli/" + std::to_string(stimulus.place) + "/seen/what",
               "expected 'nothing', or the key 'view' of the protocol: it says where the picture "
               "and the eyes are");
  }
  if (protocol.renderers.size() > 1) {
    for (const TaskBlock& block : protocol.blocks) {
      if (block.task != TaskKind::identify || block.renderers.size() < 2) continue;
      for (const int index : block.stimuli) {
        const StimulusSpec& stimulus = protocol.stimuli[static_cast<std::size_t>(index)];
        if (stimulus.felt) continue;
        faults.add("/stimuli/" + std::to_string(stimulus.place) + "/felt",
                   "expected true: block '" + block.name +
                       "' compares renderers, and this stimulus is not felt");
      }
    }
  }
  if (protocol.cues && faults.empty()) check_cues(protocol, faults);
}

}  // namespace palpate::protocols
