// The parser agrees with the published schemas, value by value. A missing key has the documented
// default: writing the default gives the same values, another value does not. Every number is
// accepted up to the documented bounds and not beyond.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "protocols/parse.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

json schema(const std::string& name) {
  std::ifstream stream(PALPATE_SOURCE_DIR "/protocols/" + name);
  return json::parse(stream);
}

/// The schema of each key of an object, by the key's place; for arrays, that of the first element.
/// \param root  the target of "#/..."
void collect(const json& object, const json& root, const std::string& place,
             std::map<std::string, json>& out) {
  const auto resolved = [&root](const json& value) {
    const std::string reference = value.value("$ref", "");
    if (reference.rfind("#/", 0) != 0) return value;
    json whole = root.at(json::json_pointer(reference.substr(1)));
    whole.update(value);
    return whole;
  };
  const json keys = object.value("properties", json::object());
  for (const auto& [key, value] : keys.items()) {
    const json whole = resolved(value);
    out[place + "/" + key] = whole;
    collect(whole, root, place + "/" + key, out);
  }
  for (const json& branch : object.value("allOf", json::array()))
    collect(branch.value("then", json::object()), root, place, out);
  const json element = object.contains("items") ? resolved(object["items"]) : json::object();
  if (element.contains("type")) out[place + "/0"] = element;
  if (element.contains("properties")) collect(element, root, place + "/0", out);
}

/// Keys beside the objects: at the top of a scene, and likewise of a protocol.
std::map<std::string, json> keys_of_tool_and_reach() {
  const json root = schema("scene.schema.json");
  std::map<std::string, json> keys;
  for (const char* key : {"tool", "reach"})
    collect(root.at("$defs").at(key), root, std::string("/") + key, keys);
  return keys;
}

std::map<std::string, json> keys_of_a_protocol() {
  const json root = schema("protocol.schema.json");
  std::map<std::string, json> keys;
  collect(root, root, "", keys);
  return keys;
}

/// As keys of a stimulus that has them; see kShapes.
std::map<std::string, json> keys_of_an_object() {
  const json root = schema("scene.schema.json");
  std::map<std::string, json> keys, out;
  collect(root.at("$defs").at("object"), root, "", keys);
  for (const auto& [place, key] : keys) {
    // Their keys depend on their kind (parse_effects_test.cpp).
    if (place.rfind("/texture", 0) == 0 || place.rfind("/fields", 0) == 0) continue;
    const bool cylinder = place == "/segments" || place == "/height_m";
    const bool box = place.rfind("/size_m", 0) == 0;
    const char* stimulus = cylinder             ? "/stimuli/1"
                           : place == "/edge_m" ? "/stimuli/2"
                           : box                ? "/stimuli/3"
                           : place == "/scale"  ? "/stimuli/4"
                                                : "/stimuli/0";
    out[stimulus + place] = key;
  }
  return out;
}

json values(const Vec3& v) { return {v.x, v.y, v.z}; }

template <class T>
json value_or_null(const std::optional<T>& value) {
  return value ? json(*value) : json();
}

json values(const stimuli::Material& m) {
  json layers;
  for (const stimuli::Layer& layer : m.layers)
    layers.push_back(
        {layer.depth, layer.stiffness, layer.damping, value_or_null(layer.break_force)});
  return {m.stiffness, m.damping, m.friction_static, m.friction_dynamic, layers};
}

json values(const stimuli::ObjectSpec& o) {
  const Quat& q = o.pose.orientation;
  json parts, body, knock;
  if (o.transient) knock = {o.transient->amplitude, o.transient->frequency, o.transient->decay};
  for (const stimuli::ObjectSpec& part : o.parts) parts.push_back(values(part));
  if (o.body)
    body = {value_or_null(o.body->mass),
            value_or_null(o.body->density),
            values(o.body->velocity),
            values(o.body->spin),
            o.body->damping,
            o.body->restitution,
            o.body->friction};
  return {o.shape,
          o.radius,
          o.height,
          o.edge,
          values(o.size),
          o.segments,
          o.subdivisions,
          o.scale,
          parts,
          values(o.pose.position),
          {q.w, q.x, q.y, q.z},
          values(o.material),
          body,
          knock};
}

json values(const Protocol& p) {
  json all = {p.renderer_order,
              p.repetitions,
              p.order.kind,
              value_or_null(p.order.max_run),
              value_or_null(p.order.min_distance),
              p.blocks_per_renderer,
              p.orientation,
              p.practice.repetitions,
              value_or_null(p.practice.criterion),
              p.practice.max_rounds,
              p.sessions.count,
              value_or_null(p.sessions.max_minutes),
              p.sessions.warm_up_trials,
              value_or_null(p.breaks.every_trials),
              p.breaks.min_seconds,
              p.blocks.front().time_out,
              p.blocks.front().feedback,
              p.stylus.length,
              p.stylus.grip,
              values(p.workspace.centre),
              p.workspace.scale,
              values(p.material),
              p.servo_rate,
              p.passivity_controller,
              p.material_limit,
              p.torque,
              p.home.rest,
              p.home.margin,
              p.texts.move_away,
              p.texts.ready,
              p.texts.go,
              p.texts.wait,
              p.texts.other_key,
              p.samples,
              p.seed};
  if (p.reach) all.push_back({p.reach->factor, p.reach->pivot, values(p.reach->point)});
  for (const ToolSegmentSpec& segment : p.tool.segments)
    all.push_back({values(segment.from), values(segment.to)});
  if (p.masking_noise) all.push_back({p.masking_noise->kind, p.masking_noise->level_db});
  for (const StimulusSpec& stimulus : p.stimuli) all.push_back(values(stimulus.object));
  return all;
}

json parsed(const json& document) { return values(parse_protocol_text(document.dump(), "p.json")); }

/// Some value that the schema allows and that is not the default.
json other_value(const json& key) {
  const json& usual = key["default"];
  for (const json& word : key.value("enum", json::array()))
    if (word != usual) return word;
  if (key.contains("anyOf"))
    for (const json& word : key["anyOf"][0]["enum"])
      if (word != usual) return word;
  if (usual.is_boolean()) return !usual.get<bool>();
  if (usual.is_string()) return "another text";
  if (usual.is_null()) return std::min(2, key.value("maximum", 2));
  if (usual == json::array()) return json::parse(R"([{"depth_m": 0.001, "stiffness_n_per_m": 9}])");
  if (usual.is_array()) return usual.size() == 4 ? json{0, 1, 0, 0} : json{0.5, 0, 0};
  if (key["type"] == "integer" || usual == 0) return usual.get<int>() + 1;
  return usual.get<double>() / 2;
}

const json kShapes = json::parse(R"({"version": 1, "name": "p", "renderers": ["point", "ray"],
  "stimuli": [{"name": "a", "shape": "sphere", "radius_m": 0.02,
               "layers": [{"depth_m": 0.001, "stiffness_n_per_m": 100}], "body": {"mass_kg": 0.1}},
              {"name": "b", "shape": "cylinder", "radius_m": 0.02, "height_m": 0.03},
              {"name": "c", "shape": "cube", "edge_m": 0.02},
              {"name": "d", "shape": "box", "size_m": [0.02, 0.02, 0.02]},
              {"name": "e", "shape": "mesh", "file": ")" PALPATE_SOURCE_DIR
                                 R"(/tests/protocols/good/tetrahedron.obj"}],
  "repetitions": 10, "reach": {"factor": 2}, "practice": {"repetitions": 1}, "masking_noise": {},
  "response": {"keys": {"1": "a", "2": "b", "3": "c", "4": "d", "5": "e"}}})");

void expect_default(const std::string& place, const json& key) {
  const json::json_pointer pointer(place);
  json missing = kShapes, written = kShapes, other = kShapes;
  written[pointer] = key["default"];
  other[pointer] = other_value(key);
  missing[pointer] = 0;  // so that the section exists
  missing[pointer.parent_pointer()].erase(pointer.back());
  if (pointer.back() == "repetitions") missing.erase("practice");
  EXPECT_EQ(parsed(missing), parsed(written)) << place << " is not " << key["default"];
  EXPECT_NE(parsed(missing), parsed(other)) << place << " makes no difference";
  const std::string words = key.value("description", "");
  if (key["default"].is_null() || key["default"] == json::array()) return;
  const std::string value =
      key["default"].is_string() ? key["default"].get<std::string>() : key["default"].dump();
  std::string spaced;  // [0,0,0] as it is written: [0, 0, 0]
  for (const char c : value)
    spaced += c == ',' && key["default"].is_array() ? ", " : std::string(1, c);
  EXPECT_NE(words.find("efault"), std::string::npos) << place;
  EXPECT_NE(words.find(spaced), std::string::npos) << place << ": " << words;
}

int expect_defaults(const std::map<std::string, json>& keys) {
  int count = 0;
  for (const auto& [place, key] : keys) {
    if (!key.contains("default")) continue;
    expect_default(place, key);
    ++count;
  }
  return count;
}

TEST(Defaults, MatchTheSchemasProtocol) { EXPECT_GE(expect_defaults(keys_of_a_protocol()), 33); }

TEST(Defaults, MatchTheSchemasObject) { EXPECT_GE(expect_defaults(keys_of_an_object()), 10); }

TEST(Defaults, MatchTheSchemasToolAndReach) {
  EXPECT_GE(expect_defaults(keys_of_tool_and_reach()), 1);
}

TEST(Defaults, MissingSectionsActAsEmptyOnes) {
  for (const char* section : {"order", "sessions", "breaks", "stylus", "workspace", "material",
                              "servo", "home", "texts"}) {
    json empty = kShapes;
    empty[section] = json::object();
    EXPECT_EQ(parsed(kShapes), parsed(empty)) << section;
  }
}

TEST(Defaults, CriterionGivesPracticeFiveRoundsElseOne) {
  json document = kShapes;
  EXPECT_EQ(parse_protocol_text(document.dump(), "p.json").practice.max_rounds, 1);
  document["practice"]["criterion"] = 0.8;
  EXPECT_EQ(parse_protocol_text(document.dump(), "p.json").practice.max_rounds, 5);
}

/// The parser's fault for this value at this place (of three numbers, the first); none: accepted.
std::optional<std::string> refusal(const std::string& place, const json& value) {
  json document = kShapes;
  document["no such key"] = 1;  // so that only the values themselves are checked
  document["stylus"] = {{"length_m", 10}};
  const json::json_pointer pointer(place);
  const bool element = pointer.back() == "0" && value.is_number();
  document[element ? pointer.parent_pointer() : pointer] = element ? json{value, 0, 0} : value;
  try {
    parse_protocol_text(document.dump(), "p.json");
  } catch (const InputError& error) {
    for (const Fault& fault : error.faults())
      if (fault.location == place ||
          (element && fault.location == pointer.parent_pointer().to_string()))
        return fault.expected;
    return std::nullopt;
  }
  ADD_FAILURE() << "an unknown key was taken";
  return std::nullopt;
}

/// The unit at the end of a key's name.
std::string unit_of(const std::string& place) {
  const std::pair<const char*, const char*> units[] = {{"_m_per_s/0", " m/s"},
                                                       {"_rad_per_s/0", " rad/s"},
                                                       {"_per_s", " 1/s"},
                                                       {"_kg", " kg"},
                                                       {"_kg_per_m3", " kg/m^3"},
                                                       {"_n_per_m", " N/m"},
                                                       {"_ns_per_m", " N s/m"},
                                                       {"_m", " m"},
                                                       {"_m/0", " m"},
                                                       {"_s", " s"},
                                                       {"_seconds", " s"},
                                                       {"_hz", " Hz"},
                                                       {"_minutes", " min"},
                                                       {"_db", " dB"}};
  for (const auto& [ending, unit] : units)
    if (place.ends_with(ending)) return unit;
  return "";
}

/// \return the number of bounds
int expect_bounds(const std::string& place, const json& key) {
  int count = 0;
  const bool whole = key.value("type", json()).dump().find("integer") != std::string::npos;
  const auto expect = [&](const char* word, double sign, bool bound_itself) {
    if (!key.contains(word)) return;
    ++count;
    const json& bound = key[word];
    json beyond, within;
    if (whole && bound.is_number_unsigned() && sign > 0) {
      if (bound == std::numeric_limits<std::uint64_t>::max()) return;
      beyond = bound.get<std::uint64_t>() + 1;
      within = bound.get<std::uint64_t>() - 1;
    } else if (whole) {
      beyond = bound.get<std::int64_t>() - 1;
      within = bound.get<std::int64_t>() + 1;
    } else {
      const double value = bound.get<double>(), far = sign * std::numeric_limits<double>::max();
      beyond = std::nextafter(value, far);
      within = std::nextafter(value, -far);
    }
    const std::string why = refusal(place, beyond).value_or("it was taken");
    EXPECT_EQ(why.rfind("expected", 0), 0u) << place << ": " << beyond << ": " << why;
    EXPECT_NE((why + ",").find(unit_of(place) + ","), std::string::npos) << place << ": " << why;
    EXPECT_FALSE(refusal(place, within)) << place << ": " << within;
    EXPECT_EQ(!refusal(place, bound), bound_itself) << place << ": " << bound;
  };
  expect("minimum", -1, true);
  expect("maximum", 1, true);
  expect("exclusiveMinimum", -1, false);
  return count;
}

int expect_bounds(const std::map<std::string, json>& keys) {
  int count = 0;
  for (const auto& [place, key] : keys)
    if (place.find("orientation") == std::string::npos) count += expect_bounds(place, key);
  return count;
}

TEST(Bounds, MatchTheSchemasProtocol) { EXPECT_GE(expect_bounds(keys_of_a_protocol()), 40); }

TEST(Bounds, MatchTheSchemasObject) { EXPECT_GE(expect_bounds(keys_of_an_object()), 24); }

TEST(Bounds, MatchTheSchemasToolAndReach) { EXPECT_GE(expect_bounds(keys_of_tool_and_reach()), 6); }

}  // namespace
}  // namespace palpate::protocols
