#include "runner/session/replay.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/session/device_check.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

using Json = nlohmann::ordered_json;

data::TrialName trial_name(const std::string& text) {
  const auto bad = [] {
    return UsageError("--trial: expected CODE/SESSION/TRIAL, e.g. P03/1/12, the numbers from 1");
  };
  data::TrialName name;
  std::istringstream parts(text);
  std::string session, trial;
  if (!std::getline(parts, name.code, '/') || !std::getline(parts, session, '/') ||
      !std::getline(parts, trial) || name.code.empty()) {
    throw bad();
  }
  const auto number = [&](const std::string& digits) {
    int value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc{} || end != digits.data() + digits.size() || value < 1) throw bad();
    return value;
  };
  name.session = number(session);
  name.trial = number(trial);
  return name;
}

/// The completed attempt, of the protocol that was named where there are several.
data::StoredTrial find_trial(data::Store& store, const data::TrialName& name,
                             const std::string& protocol) {
  const std::string shown =
      name.code + "/" + std::to_string(name.session) + "/" + std::to_string(name.trial);
  std::optional<data::StoredTrial> found;
  bool cut_off = false;
  std::string protocols;
  for (data::StoredTrial& trial : store.attempts(name)) {
    if (!protocol.empty() && trial.protocol_name != protocol) continue;
    if (!trial.cut_off_reason.empty()) {
      cut_off = true;
      continue;
    }
    protocols += (protocols.empty() ? "" : ", ") + trial.protocol_name;
    if (found) {
      throw UsageError("--trial " + shown + ": there is one in each of several protocols (" +
                       protocols + "); say which with --protocol NAME");
    }
    found = std::move(trial);
  }
  if (!found) {
    throw UsageError(
        store.path() + ": " + shown +
        (cut_off ? " was cut off before an answer: nothing of it was kept to replay"
                 : " is not on record" + (protocol.empty() ? "" : " in protocol " + protocol)));
  }
  if (found->record.samples.empty()) {
    throw UsageError(store.path() + ": " + shown +
                     " was recorded without servo samples; a protocol with \"samples\": true "
                     "keeps them");
  }
  return std::move(*found);
}

/// Scales the materials down to what the device of the trial's run could show. True: there were
/// any.
bool limit_as_recorded(protocols::Protocol& protocol, data::Store& store,
                       const data::StoredTrial& trial) {
  for (const data::StoredNote& note : store.notes()) {
    const data::ClockStamp &noted = note.run_clock, &shown = trial.run.clock;
    if (note.participant.id != trial.participant.id || note.session != trial.record.session ||
        noted.utc_ns != shown.utc_ns || noted.monotonic_ns != shown.monotonic_ns) {
      continue;
    }
    try {
      // A simulated session that was gone on with has the same event again.
      if (runner::limit_as_recorded(protocol, note.text)) return true;
    } catch (const std::invalid_argument& error) {
      throw data::StoreRefused(store.path() + ": " + error.what());
    }
  }
  return false;
}

protocols::RendererKind kind_of(const std::string& renderer) {
  return renderer == protocols::to_string(protocols::RendererKind::ray)
             ? protocols::RendererKind::ray
             : protocols::RendererKind::point;
}

double length(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

/// One renderer's forces along the way.
struct Shown {
  std::string renderer;
  std::size_t in_contact = 0;
  double first_contact = -1;  ///< s from time zero; below 0: none
  double square_sum = 0, most_force = 0, most_depth = 0;

  void add(double time, double force, double depth, int contacts) {
    if (contacts > 0 && first_contact < 0) first_contact = time;
    in_contact += contacts > 0;
    square_sum += force * force;
    most_force = std::max(most_force, force);
    most_depth = std::max(most_depth, depth);
  }
};

struct Outcome {
  std::size_t ticks = 0, equal = 0;
  bool periods_known = true;
  std::optional<std::uint32_t> first_difference;  ///< tick
  Shown recorded, other;
  double difference_square_sum = 0, most_difference = 0;  ///< N, of the two renderers' forces
  std::string rows;                                       ///< CSV
};

void put(std::string& out, double value) {
  char text[40];
  std::snprintf(text, sizeof text, ",%.17g", value == 0 ? 0.0 : value);
  out += text;
}

/// \param rows  whether to keep a row for each tick
Outcome replay_stored(const protocols::Protocol& protocol, const data::TrialRecord& record,
                      bool compare, bool rows) {
  Outcome outcome;
  const protocols::RendererKind kind = kind_of(record.renderer);
  const protocols::RendererKind other = kind == protocols::RendererKind::ray
                                            ? protocols::RendererKind::point
                                            : protocols::RendererKind::ray;
  std::vector<Vec3> forces;  // as recorded
  std::vector<std::string> lines;
  double time = 0;
  outcome.recorded.renderer = protocols::to_string(kind);
  replay(protocol, record, kind, [&](const data::SampleRecord& was, const Sample& is) {
    if (outcome.ticks > 0) time += static_cast<double>(is.period_ns) * 1e-9;
    if (was.period_ns <= 0) outcome.periods_known = false;
    ++outcome.ticks;
    if (equals_record(was, is)) {
      ++outcome.equal;
    } else if (!outcome.first_difference) {
      outcome.first_difference = was.tick;
    }
    outcome.recorded.add(time, length(was.force), was.depth, was.contacts);
    if (compare) forces.emplace_back(was.force[0], was.force[1], was.force[2]);
    if (!rows) return;
    std::string line = std::to_string(was.tick);
    put(line, time);
    for (const auto& v : {was.tip, was.tail, was.force, was.torque}) {
      for (const double x : v) put(line, x);
    }
    put(line, was.depth);
    for (const Vec3& v : {is.rendering.force, is.rendering.torque}) {
      for (int i = 0; i < 3; ++i) put(line, v[i]);
    }
    put(line, is.rendering.deepest.depth);
    lines.push_back(std::move(line));
  });
  if (compare) {
    outcome.other.renderer = protocols::to_string(other);
    std::size_t at = 0;
    time = 0;
    replay(protocol, record, other, [&](const data::SampleRecord&, const Sample& is) {
      if (at > 0) time += static_cast<double>(is.period_ns) * 1e-9;
      const rendering::Rendering& r = is.rendering;
      outcome.other.add(time, glm::length(r.force), r.deepest.depth, static_cast<int>(r.contacts));
      const double apart = glm::length(r.force - forces[at]);
      outcome.difference_square_sum += apart * apart;
      outcome.most_difference = std::max(outcome.most_difference, apart);
      if (rows) {
        for (const Vec3& v : {r.force, r.torque}) {
          for (int i = 0; i < 3; ++i) put(lines[at], v[i]);
        }
        put(lines[at], r.deepest.depth);
      }
      ++at;
    });
  }
  for (std::string& line : lines) outcome.rows += line + "\n";
  return outcome;
}

std::string csv_header(bool compare) {
  std::string header = "tick,t";
  for (const char* vector : {"tip", "tail", "recorded_force", "recorded_torque"}) {
    for (const char* axis : {"_x", "_y", "_z"}) header += std::string(",") + vector + axis;
  }
  header += ",recorded_depth";
  for (const char* whose : {"again", "other"}) {
    if (!compare && whose[0] == 'o') break;
    for (const char* what : {"_force", "_torque"}) {
      for (const char* axis : {"_x", "_y", "_z"}) header += std::string(",") + whose + what + axis;
    }
    header += std::string(",") + whose + "_depth";
  }
  return header + "\n";
}

Json shown_json(const Shown& s, std::size_t ticks) {
  return {{"renderer", s.renderer},
          {"share_in_contact", static_cast<double>(s.in_contact) / static_cast<double>(ticks)},
          {"first_contact_s", s.first_contact < 0 ? Json() : Json(s.first_contact)},
          {"rms_force_n", std::sqrt(s.square_sum / static_cast<double>(ticks))},
          {"max_force_n", s.most_force},
          {"max_depth_m", s.most_depth}};
}

void print_shown(const Shown& s, const char* how, std::size_t ticks) {
  char line[200];
  char first[40] = "never";
  if (s.first_contact >= 0) std::snprintf(first, sizeof first, "%.3f s", s.first_contact);
  std::snprintf(line, sizeof line,
                "  %-5s (%s): first contact %s, in contact %.1f %% of the time, force rms %.3f N, "
                "at most %.3f N, %.2f mm deep\n",
                s.renderer.c_str(), how, first,
                100.0 * static_cast<double>(s.in_contact) / static_cast<double>(ticks),
                std::sqrt(s.square_sum / static_cast<double>(ticks)), s.most_force,
                1e3 * s.most_depth);
  std::cout << line;
}

}  // namespace

int replay_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate replay --db FILE --trial CODE/SESSION/TRIAL [--compare] [--out FILE.csv]";
  line.summary =
      "Puts a stored trial through the servo and its renderer again: the forces must be the\n"
      "recorded ones, bit by bit. Needs servo samples (\"samples\": true in the protocol).\n"
      "Status 1 when a tick differs.";
  line.example =
      "  palpate replay --db study.db --trial P03/1/12\n"
      "  palpate replay --db study.db --trial P03/1/12 --compare --out both.csv   (and what the\n"
      "      other renderer would have shown on the same way, tick by tick)";
  std::string db, trial, protocol_name, out, json, folder;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("db", po::value(&db)->value_name("FILE")->required(), "the study's database; only read");
  add("trial", po::value(&trial)->value_name("CODE/SESSION/TRIAL")->required(), "which trial");
  add("protocol", po::value(&protocol_name)->value_name("NAME"),
      "of which protocol, where the code is in several");
  add("meshes", po::value(&folder)->value_name("DIR"),
      "where the protocol's mesh files are, for a database of before they were kept in it;\n"
      "default: the working directory");
  add("compare", "also show what the other renderer would have shown");
  add("out", po::value(&out)->value_name("FILE.csv"), "write every tick");
  add("json", po::value(&json)->value_name("FILE"), "write the figures as JSON");
  add("force", "replace files that are there");
  const auto values = line.parse(args);
  if (!values) return 0;
  Outputs outputs(*values, {"out", "json"}, {"db"});
  const data::TrialName name = trial_name(trial);
  data::Store store = data::Store::open(db, data::Store::Mode::read_only);
  const data::StoredTrial stored = find_trial(store, name, protocol_name);
  const data::TrialRecord& record = stored.record;
  // Where a run was shown with another text, it differs in words only.
  std::string text;
  for (const data::ProtocolInfo& info : store.protocols()) {
    if (info.sha256 == stored.protocol_sha256) text = info.text;
  }
  protocols::StoredFiles files;
  for (data::ProtocolFile& file : store.files(stored.protocol_sha256)) {
    files.emplace(file.name, std::move(file.bytes));
  }
  protocols::Protocol protocol = protocols::parse_protocol_text(
      text, (std::filesystem::path(folder) / (stored.protocol_name + ".json")).string(), files);
  const auto& stimuli = protocol.stimuli;
  for (const protocols::StimulusSpec& stimulus : stimuli) outputs.keep(stimulus.object);
  if (std::none_of(stimuli.begin(), stimuli.end(),
                   [&](const auto& stimulus) { return stimulus.name == record.shape; })) {
    throw data::StoreRefused(db + ": trial " + trial + " shows '" + record.shape +
                             "', which its protocol " + stored.protocol_name +
                             " does not have; expected one of its stimuli");
  }
  const bool limited = limit_as_recorded(protocol, store, stored);
  const bool compare = values->count("compare") > 0;
  const Outcome outcome = replay_stored(protocol, record, compare, !out.empty());

  outputs.put("out", csv_header(compare) + outcome.rows);
  const bool equal = outcome.equal == outcome.ticks;
  if (!json.empty()) {
    Json result = {{"version", 1},
                   {"trial", trial},
                   {"protocol", stored.protocol_name},
                   {"simulated", stored.participant.simulated},
                   {"recorded_with", stored.run.program_version},
                   {"replayed_with", PALPATE_VERSION},
                   {"ticks", outcome.ticks},
                   {"equal_ticks", outcome.equal},
                   {"periods_on_record", outcome.periods_known},
                   {"material_limited", limited},
                   {"recorded", shown_json(outcome.recorded, outcome.ticks)}};
    if (compare) {
      result["other"] = shown_json(outcome.other, outcome.ticks);
      result["rms_difference_n"] =
          std::sqrt(outcome.difference_square_sum / static_cast<double>(outcome.ticks));
      result["max_difference_n"] = outcome.most_difference;
    }
    outputs.put("json", result.dump(1) + "\n");
  }
  outputs.write();
  std::cout << (stored.participant.simulated ? "SIMULATED " : "") << "trial "
            << stimuli::printable(trial) << " of " << stimuli::printable(stored.protocol_name)
            << ": " << stimuli::printable(record.shape) << ", "
            << stimuli::printable(record.renderer) << ", ";
  if (record.timed_out) {
    std::cout << "no answer";
  } else {
    std::cout << "answered " << stimuli::printable(record.response);
  }
  char time[40];
  std::snprintf(time, sizeof time, " after %.3f s", record.response_time);
  std::cout << time << "\n";
  if (limited)
    std::cout << "With the materials as they were limited to what the device can show.\n";
  if (equal) {
    std::cout << "Rendered again: all " << outcome.ticks
              << " ticks equal the record, bit by bit.\n";
  } else {
    std::cout << "Rendered again: " << outcome.ticks - outcome.equal << " of " << outcome.ticks
              << " ticks differ from the record, the first is tick "
              << outcome.first_difference.value_or(0) << ". Recorded with palpate "
              << stimuli::printable(stored.run.program_version) << ", replayed with "
              << PALPATE_VERSION << ".\n";
    if (!outcome.periods_known) {
      std::cout << "The record does not hold the ticks' periods, on which damping depends.\n";
    }
  }
  print_shown(outcome.recorded, "recorded", outcome.ticks);
  if (compare) {
    print_shown(outcome.other, "same way", outcome.ticks);
    char apart[120];
    std::snprintf(apart, sizeof apart, "  their forces differ by %.3f N rms, at most %.3f N\n",
                  std::sqrt(outcome.difference_square_sum / static_cast<double>(outcome.ticks)),
                  outcome.most_difference);
    std::cout << apart;
  }
  return equal ? 0 : 1;
}

}  // namespace palpate::runner
