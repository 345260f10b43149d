#include "protocols/parse.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "data/base/checksum.h"
#include "data/base/text.h"
#include "protocols/answer_keys.h"
#include "protocols/event_codes.h"
#include "protocols/factors.h"
#include "protocols/groups.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "protocols/parse_scene.h"
#include "protocols/parse_sight.h"
#include "protocols/parse_tool.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/parse_blocks.h"
#include "protocols/tested_effects.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxLabel = 80;  // bytes of a label

/// The changes that groups make to a protocol.
struct Patches {
  std::vector<json> of_groups;
  bool masked = false;  ///< names of groups
};

/// The stimulus that a key stands for: its name, or an object of name and label. Not a string, and
/// a fault, otherwise.
json read_answer(const json& value, const std::string& pointer, std::string& label,
                 FaultList& faults) {
  if (!value.is_object()) return value;
  ObjectReader answer(value, pointer, faults);
  const json* const stimulus = answer.member("stimulus", Presence::required);
  const json* const words = answer.member("label");
  answer.refuse_unknown_keys();
  if (words != nullptr) {
    const auto printable = [](unsigned char c) { return c >= 0x20 && c != 0x7f; };
    label = words->is_string() ? words->get<std::string>() : "";
    if (label.empty() || label.size() > kMaxLabel ||
        !std::all_of(label.begin(), label.end(), printable)) {
      faults.add(answer.pointer("label"), "expected a text of 1 to " + std::to_string(kMaxLabel) +
                                              " bytes without control characters" +
                                              found_text(*words));
      label.clear();
    }
  }
  return stimulus != nullptr ? *stimulus : json();
}

/// Labels must differ: two responses that read the same cannot be told apart.
void check_labels(const Protocol& protocol, const std::string& pointer, FaultList& faults) {
  std::map<std::string, std::string> key_of;  // by label
  for (const auto& [key, stimulus] : protocol.response.keys) {
    const std::string& label = answer_label(protocol, stimulus);
    const auto [before, is_new] = key_of.emplace(label, key);
    if (is_new || protocol.response.keys.at(before->second) == stimulus) continue;
    faults.add(child_pointer(pointer, key), "expected a unique label; the key '" + before->second +
                                                "' has the label '" + label + "' already");
  }
}

/// Reads `keys` of a response of version 1: every stimulus has one key, every label is its own.
void read_response_keys(ObjectReader& response, Protocol& protocol) {
  const json* const keys = response.member("keys", Presence::required);
  if (keys == nullptr) return;
  FaultList& faults = response.faults();
  const std::string pointer = response.pointer("keys");
  if (!keys->is_object()) {
    faults.add(pointer, "expected an object of a stimulus for each key" + found_text(*keys));
    return;
  }
  std::map<std::string, std::optional<std::string>> key_of;  // by stimulus
  for (const StimulusSpec& stimulus : protocol.stimuli) key_of[stimulus.name];
  KeysTaken taken;
  for (const auto& [key, value] : keys->items()) {
    const std::string here = child_pointer(pointer, key);
    if (const std::string fault = taken.add(key); !fault.empty()) faults.add(here, fault);
    std::string label;
    const json name = read_answer(value, here, label, faults);
    const auto stimulus = name.is_string() ? key_of.find(name.get<std::string>()) : key_of.end();
    if (stimulus == key_of.end()) {
      if (!value.is_object()) {
        faults.add(here, "expected the name of a stimulus, or an object of 'stimulus' and 'label'" +
                             found_text(value));
      } else if (value.contains("stimulus")) {
        faults.add(child_pointer(here, "stimulus"),
                   "expected the name of a stimulus" + found_text(name));
      }
      continue;
    }
    if (stimulus->second) {
      faults.add(here, "expected one key for each stimulus; '" + stimulus->first +
                           "' has the key '" + *stimulus->second + "' already");
    }
    stimulus->second = key;
    protocol.response.keys[key] = stimulus->first;
    if (!label.empty()) protocol.response.labels[stimulus->first] = label;
  }
  check_labels(protocol, pointer, faults);
  for (const auto& [name, key] : key_of) {
    if (!key && !name.empty()) faults.add(pointer, "no key for the stimulus '" + name + "'");
  }
}

// Keys and names from a file must not add lines to the list.
std::string list(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) {
    text += (text.empty() ? "" : "\n") + printable(fault.file);
    // A location that is a line says it itself.
    if (fault.line > 0 && fault.location.starts_with('/'))
      (text += ':') += std::to_string(fault.line);
    if (!fault.location.empty()) text += ": " + printable(fault.location);
    text += ": " + printable(fault.expected);
  }
  return text;
}

// More than a laboratory needs; a larger value is a mistake.
constexpr std::size_t kMaxStimuli = 100;
constexpr std::size_t kMaxOrientations = 10000;
constexpr long long kMaxTrials = 1000000;
constexpr NumberRange kRepetitions{1, 1e6};
constexpr NumberRange kCount{1, 1e6};
constexpr NumberRange kFewFromZero{0, 10000};
constexpr NumberRange kFew{1, 10000};
constexpr int kRoundsWithCriterion = 5;  // of practice, unless max_rounds says otherwise

void read_renderers(ObjectReader& reader, Protocol& protocol) {
  const json* const list = reader.array("renderers", 1, 2, Presence::required);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("renderers"), i);
    RendererKind kind{};
    if (!read_choice((*list)[i], pointer, kind,
                     {{to_string(RendererKind::point), RendererKind::point},
                      {to_string(RendererKind::ray), RendererKind::ray}},
                     reader.faults())) {
      continue;
    }
    const auto& renderers = protocol.renderers;
    if (std::find(renderers.begin(), renderers.end(), kind) != renderers.end()) {
      reader.faults().add(pointer,
                          "expected each renderer once" + found_text((*list)[i]) + " again");
    }
    protocol.renderers.push_back(kind);
  }
}

void read_stimuli(ObjectReader& reader, Protocol& protocol, const MeshFiles& files) {
  const json* const list = reader.array("stimuli", 1, kMaxStimuli, Presence::required);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("stimuli"), i);
    ObjectReader item((*list)[i], pointer, reader.faults());
    protocol.stimuli.push_back(read_stimulus(item, protocol.material, files));
    protocol.stimuli.back().place = i;
    protocol.stimulus_texts.push_back((*list)[i].dump());
    const std::string& name = protocol.stimuli.back().name;
    if (!name.empty() && !names.insert(name).second) {
      reader.faults().add(item.pointer("name"),
                          "expected a unique name, found '" + name + "' again");
    }
  }
}

void read_orientation(ObjectReader& reader, Protocol& protocol) {
  const json* const value = reader.member("orientation");
  if (value == nullptr) return;
  if (!value->is_array()) {
    if (value->is_string()) {
      read_choice(*value, reader.pointer("orientation"), protocol.orientation,
                  {{"uniform", OrientationKind::uniform}, {"fixed", OrientationKind::fixed}},
                  reader.faults());
    } else {
      reader.faults().add(
          reader.pointer("orientation"),
          "expected 'uniform', 'fixed' or an array of quaternions" + found_text(*value));
    }
    return;
  }
  protocol.orientation = OrientationKind::listed;
  if (reader.array("orientation", 1, kMaxOrientations) == nullptr) return;
  for (std::size_t i = 0; i < value->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("orientation"), i);
    if (const auto rotation = read_quaternion((*value)[i], pointer, reader.faults())) {
      protocol.orientations.push_back(*rotation);
    }
  }
}

void read_breaks(ObjectReader& reader, Protocol& protocol) {
  reader.section("breaks", [&](ObjectReader& section) {
    section.integer("every_trials", protocol.breaks.every_trials, kCount);
    section.number("min_seconds", protocol.breaks.min_seconds, {0, 3600, "s"});
  });
}

void read_texts(ObjectReader& section, Protocol::Texts& texts) {
  section.text("instructions", texts.instructions);
  section.text("practice", texts.practice);
  section.text("break", texts.break_text);
  section.text("end", texts.end);
  section.text("move_away", texts.move_away);
  section.text("ready", texts.ready);
  section.text("go", texts.go);
  section.text("wait", texts.wait);
  section.text("other_key", texts.other_key);
}

void read_task_texts(ObjectReader& section, Protocol::Texts& texts) {
  section.text("next_interval", texts.next_interval);
  section.text("answer_now", texts.answer_now);
  section.text("type_number", texts.type_number);
  section.text("agree", texts.agree);
  section.text("disagree", texts.disagree);
  section.text("other_number", texts.other_number);
  section.text("answer_first", texts.answer_first);
  section.text("go_home", texts.go_home);
}

void read_session_settings(ObjectReader& reader, Protocol& protocol) {
  reader.section("practice", [&](ObjectReader& section) {
    auto& practice = protocol.practice;
    section.integer("repetitions", practice.repetitions, kFewFromZero);
    section.number("criterion", practice.criterion, {0, 1, "", true});
    if (practice.criterion) practice.max_rounds = kRoundsWithCriterion;
    section.integer("max_rounds", practice.max_rounds, kFew);
    if (practice.criterion && practice.repetitions == 0) {
      section.faults().add(section.pointer("criterion"), "a criterion needs repetitions above 0");
    }
  });
  reader.section("sessions", [&](ObjectReader& section) {
    section.integer("count", protocol.sessions.count, {1, 1000});
    section.number("max_minutes", protocol.sessions.max_minutes, {0, 1440, "min", true});
    section.integer("warm_up_trials", protocol.sessions.warm_up_trials, kFewFromZero);
  });
  read_breaks(reader, protocol);
  reader.section(
      "response",
      [&](ObjectReader& section) {
        read_response_keys(section, protocol);
        section.number("time_out_s", protocol.blocks.front().time_out, {0, 3600, "s", true});
        section.boolean("feedback", protocol.blocks.front().feedback);
      },
      Presence::required);
  reader.section("texts", [&](ObjectReader& section) { read_texts(section, protocol.texts); });
}

void read_renderer_order(ObjectReader& reader, Protocol& protocol) {
  protocol.renderer_order = RendererOrder::counterbalanced;
  reader.choice("renderer_order", protocol.renderer_order,
                {{"fixed", RendererOrder::fixed},
                 {"counterbalanced", RendererOrder::counterbalanced},
                 {"interleaved", RendererOrder::interleaved}});
}

/// No page and no interval shows them.
void remove_task_texts(Protocol::Texts& texts) {
  for (std::string* const text :
       {&texts.next_interval, &texts.answer_now, &texts.type_number, &texts.agree, &texts.disagree,
        &texts.other_number, &texts.answer_first})
    text->clear();
}

/// Reads the keys that version 1 alone has.
void read_identification(ObjectReader& reader, Protocol& protocol, const MeshFiles&, Patches&) {
  reader.integer("repetitions", protocol.repetitions, kRepetitions, Presence::required);
  protocol.blocks = {shapes_block(protocol)};
  protocol.order_rule = &order_of_shapes();
  protocol.home.beyond_all = protocol.materials_vary = false;
  remove_task_texts(protocol.texts);
  reader.section("order", [&](ObjectReader& section) {
    section.choice("kind", protocol.order.kind,
                   {{"random", OrderKind::random}, {"sequential", OrderKind::sequential}});
    section.integer("max_run", protocol.order.max_run, kCount);
    section.integer("min_distance", protocol.order.min_distance, kCount);
  });
  reader.integer("blocks_per_renderer", protocol.blocks_per_renderer, kCount);
  read_orientation(reader, protocol);
  read_session_settings(reader, protocol);
}

/// Version 2: blocks of tasks, and pages.
void read_tasks(ObjectReader& reader, Protocol& protocol, const MeshFiles& files,
                Patches& patches) {
  read_factors(reader, protocol);
  read_blocks(reader, protocol);
  read_pages(reader, protocol, files);
  read_periphery(reader, protocol);
  read_orientation(reader, protocol);
  reader.section("sessions", [&](ObjectReader& section) {
    section.number("max_minutes", protocol.sessions.max_minutes, {0, 1440, "min", true});
  });
  read_breaks(reader, protocol);
  reader.section("texts", [&](ObjectReader& section) {
    read_texts(section, protocol.texts);
    read_task_texts(section, protocol.texts);
  });
  read_view(reader, protocol);
  patches.of_groups = read_groups(reader, protocol, patches.masked);
  read_tested_effects(reader, protocol);
}

void check_material_limit(ObjectReader& servo, const Protocol& protocol) {
  if (!protocol.materials_vary || protocol.material_limit != MaterialLimit::limit) return;
  servo.faults().add(servo.pointer("material_limit"),
                     "expected 'refuse' in version 2: a level that the device limits would not be "
                     "the one on record");
}

void read_apparatus(ObjectReader& reader, Protocol& protocol) {
  reader.section("stylus", [&](ObjectReader& section) {
    section.number("length_m", protocol.stylus.length, {0, 10, "m", true});
    section.number("grip_m", protocol.stylus.grip, {0, 10, "m"});
    if (protocol.stylus.grip > protocol.stylus.length) {
      section.faults().add(section.pointer("grip_m"),
                           "expected a grip on the stylus, at most at "
                           "its length_m from the tip");
    }
  });
  reader.section("workspace", [&](ObjectReader& section) {
    section.vector("centre_m", protocol.workspace.centre, {-10, 10, "m"});
    section.number("scale", protocol.workspace.scale, {0.001, 1000});
  });
  read_tool(reader, protocol.tool);
  read_reach(reader, protocol.reach);
  read_gravity(reader, protocol.gravity);
  reader.section("servo", [&](ObjectReader& section) {
    section.number("rate_hz", protocol.servo_rate, {100, 10000, "Hz"});
    section.boolean("passivity_controller", protocol.passivity_controller);
    section.choice("material_limit", protocol.material_limit,
                   {{"refuse", MaterialLimit::refuse}, {"limit", MaterialLimit::limit}});
    check_material_limit(section, protocol);
  });
  reader.choice("torque", protocol.torque,
                {{"required", TorqueRule::required}, {"left_out", TorqueRule::left_out}});
  reader.section("masking_noise", [&](ObjectReader& section) {
    MaskingNoise& noise = protocol.masking_noise.emplace();
    section.choice("kind", noise.kind,
                   {{to_string(NoiseKind::white), NoiseKind::white},
                    {to_string(NoiseKind::pink), NoiseKind::pink}});
    // Above, pink noise would be clipped; below, it would be lost in 16 bits.
    section.number("level_db", noise.level_db, {-80, -12, "dB"});
  });
  reader.section("home", [&](ObjectReader& section) {
    section.number("rest_s", protocol.home.rest, {0, 60, "s"});
    section.number("margin_m", protocol.home.margin, {0, 1, "m"});
  });
}

void read_version(ObjectReader& reader, Protocol& protocol) {
  reader.integer("version", protocol.version, {1, 2}, Presence::required);
}

/// Checks of the whole protocol: whether a schedule exists.
void check_schedule(const Protocol& protocol, FaultList& faults) {
  const long long trials = main_trials(protocol);
  if (trials > kMaxTrials) {
    faults.add("/repetitions", "expected at most " + std::to_string(kMaxTrials) +
                                   " trials for each participant, found " + std::to_string(trials));
  }
  if (protocol.blocks_per_renderer > protocol.repetitions) {
    faults.add("/blocks_per_renderer", "expected at most as many blocks as repetitions (" +
                                           std::to_string(protocol.repetitions) + "), found " +
                                           std::to_string(protocol.blocks_per_renderer));
  }
  if (protocol.sessions.count > trials) {
    faults.add("/sessions/count", "expected at most as many sessions as trials (" +
                                      std::to_string(trials) + "), found " +
                                      std::to_string(protocol.sessions.count));
  }
  faults.throw_if_any();
  try {
    for (int n = 1; n <= renderer_orders(protocol); ++n) schedule(protocol, n);
  } catch (const ScheduleError& error) {
    faults.add("/order", error.what());
  }
}

void fix_renderer_order(ObjectReader&, Protocol& protocol) {
  protocol.renderer_order = RendererOrder::fixed;  // each block has its own
}

/// The readers and checks that differ between versions, in the order of reading.
struct VersionRules {
  void (*read_order_of_renderers)(ObjectReader&, Protocol&);
  void (*read_study)(ObjectReader&, Protocol&, const MeshFiles&, Patches&);
  void (*check)(const Protocol&, FaultList&);
};

constexpr std::array<VersionRules, 2> kVersions = {
    {{read_renderer_order, read_identification, check_schedule},
     {fix_renderer_order, read_tasks, check_blocks}}};

Protocol read_design(const json& root, const MeshFiles& files, FaultList& faults,
                     Patches& patches) {
  Protocol protocol;
  ObjectReader reader(root, "", faults);
  reader.member("$schema");
  read_version(reader, protocol);
  const VersionRules& rules = kVersions.at(static_cast<std::size_t>(protocol.version) - 1);
  reader.name("name", protocol.name);
  reader.text("title", protocol.title);
  reader.text("description", protocol.description);
  read_renderers(reader, protocol);
  rules.read_order_of_renderers(reader, protocol);
  reader.section("material",
                 [&](ObjectReader& section) { read_material(section, protocol.material); });
  read_stimuli(reader, protocol, files);
  rules.read_study(reader, protocol, files, patches);
  read_apparatus(reader, protocol);
  read_event_codes(reader, protocol);  // check only; the schedule does not use them
  check_radius(reader, protocol.tool,
               std::any_of(protocol.stimuli.begin(), protocol.stimuli.end(),
                           [](const auto& stimulus) { return stimulus.object.soft.has_value(); }));
  reader.boolean("samples", protocol.samples);
  reader.seed("seed", protocol.seed);
  reader.refuse_unknown_keys();
  protocol.groups.seed = protocol.seed;
  if (patches.masked) protocol.groups.mask();
  check_reaching(protocol, faults);
  if (faults.empty()) add_cells(root, files, protocol, faults);
  if (faults.empty()) add_channels(protocol);
  if (faults.empty()) check_sight(protocol, faults);
  if (faults.empty()) rules.check(protocol, faults);
  return protocol;
}

/// Adds a fault of a group's protocol: at its place in the patch, or else at the patch.
void add_group_fault(const Fault& fault, const std::string& group, const json& patch,
                     FaultList& faults) {
  const std::string place = child_pointer("/groups/patch", group);
  const bool in_patch =
      fault.location.starts_with('/') && patch.contains(json::json_pointer(fault.location));
  faults.add(in_patch ? place + fault.location : place,
             "in group '" + group + "'" + (in_patch ? "" : ", at " + fault.location) + ": " +
                 fault.expected);
}

/// Tables have columns for what the protocol's own blocks vary: in a group they vary the same.
void check_variation(const Protocol& protocol, const Protocol& group, const std::string& name,
                     const json& patch, FaultList& faults) {
  for (const TaskBlock& block : group.blocks) {
    const auto own = std::ranges::find(protocol.blocks, block.name, &TaskBlock::name);
    const bool same = own == protocol.blocks.end()
                          ? block.dimensions.empty()
                          : own->level == block.level && own->dimensions == block.dimensions;
    if (!same)
      add_group_fault({"", "/blocks/" + std::to_string(block.place) + "/level",
                       "expected the level that the block '" + block.name +
                           "' has without the patch: tables have columns for it",
                       0},
                      name, patch, faults);
  }
}

/// Makes the protocol of each group.
void add_group_protocols(const json& root, const std::vector<json>& patches, const MeshFiles& files,
                         FaultList& faults, Protocol& protocol) {
  for (std::size_t i = 0; i < patches.size(); ++i) {
    json patched = root;
    patched.merge_patch(patches[i]);
    patched.erase("groups");
    patched.erase("tests");  // of the whole study
    FaultList own(faults.file());
    Patches none;
    auto group = std::make_shared<Protocol>();
    try {
      *group = read_design(patched, files, own, none);
      own.throw_if_any();
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults())
        add_group_fault(fault, protocol.groups.true_name(i), patches[i], faults);
      continue;
    }
    check_variation(protocol, *group, protocol.groups.true_name(i), patches[i], faults);
    group->groups = protocol.groups;
    group->source_text = protocol.source_text;
    group->sha256 = protocol.sha256;
    protocol.group_protocols.push_back(std::move(group));
  }
  faults.throw_if_any();
}

}  // namespace

InputError::InputError(std::vector<Fault> faults)
    : std::runtime_error(list(faults)), faults_(std::move(faults)) {}

Protocol parse_protocol(const std::string& path) {
  return parse_protocol_text(read_text_file(path), path);
}

Protocol parse_protocol_text(const std::string& text, const std::string& file_name,
                             const StoredFiles& stored, OtherFiles others) {
  FaultList faults(file_name);
  const json root = read_json(text, faults);
  const MeshFiles files{folder_of(file_name), stored, others};
  Patches patches;
  Protocol protocol = read_design(root, files, faults, patches);
  faults.throw_if_any();
  protocol.source_text = text;
  protocol.sha256 = checksum_hex(text);
  add_group_protocols(root, patches.of_groups, files, faults, protocol);
  return protocol;
}

}  // namespace palpate::protocols
