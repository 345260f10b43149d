#include "runner/commands/register/registration.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/sealed_folder.h"

namespace palpate::runner::commands {
namespace {

using Json = nlohmann::ordered_json;

Json counts_json(const VerdictCounts& counts) {
  return {{"corroborated", counts.corroborated},
          {"refuted", counts.refuted},
          {"undecided", counts.undecided}};
}

/// "2026-11-25T08:00:00.000000Z" as ns since 1970.
std::int64_t utc_ns_of(const std::string& text) {
  std::tm time{};
  int micros = 0, used = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2d.%6dZ%n", &time.tm_year, &time.tm_mon,
                  &time.tm_mday, &time.tm_hour, &time.tm_min, &time.tm_sec, &micros, &used) != 7 ||
      static_cast<std::size_t>(used) != text.size())
    throw std::invalid_argument("made_utc is no time: " + text);
  time.tm_year -= 1900;
  time.tm_mon -= 1;
  return (static_cast<std::int64_t>(::timegm(&time)) * 1'000'000 + micros) * 1'000;
}

}  // namespace

std::string to_line(const OrderRow& row) {
  std::string line = std::to_string(row.session) + "," + row.renderer + "," + row.shape;
  for (const double part : row.orientation_wxyz) {
    std::array<char, 40> digits{};
    const int length = std::snprintf(digits.data(), digits.size(), ",%.17g", part + 0.0);
    line.append(digits.data(), static_cast<std::size_t>(length));
  }
  return line;
}

std::vector<OrderRow> order_of(const protocols::Protocol& protocol, int participant_number) {
  std::vector<OrderRow> rows;
  for (const protocols::Trial& trial : protocols::schedule(protocol, participant_number)) {
    if (trial.practice) continue;
    const Quat& q = trial.orientation;
    rows.push_back({trial.session,
                    protocols::to_string(trial.renderer),
                    protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name,
                    {q.w, q.x, q.y, q.z}});
  }
  return rows;
}

std::string order_checksum(const std::vector<OrderRow>& rows) {
  std::string lines;
  for (const OrderRow& row : rows) lines += to_line(row) + "\n";
  return checksum_hex(lines);
}

void VerdictCounts::add(analysis::Verdict verdict) {
  corroborated += verdict == analysis::Verdict::corroborated;
  refuted += verdict == analysis::Verdict::refuted;
  undecided += verdict == analysis::Verdict::undecided;
}

const std::vector<std::string>& files_to_fill_in() {
  static const std::vector<std::string> files = {"registration.md", "osf.json"};
  return files;
}

std::string registration_json(const Registration& registration,
                              const std::vector<std::string>& texts) {
  const protocols::Protocol& protocol = registration.protocol;
  Json out;
  out["version"] = 1;
  out["made_utc"] = data::format_utc(registration.made_utc_ns);
  out["program_version"] = registration.program_version;
  out["build"] = registration.build;
  out["protocol"] = {{"file", "protocol.json"},
                     {"name", protocol.name},
                     {"sha256", protocol.sha256},
                     {"files", Json::array()}};
  for (const data::ProtocolFile& file : registration.files)
    out["protocol"]["files"].push_back({{"file", file.name}, {"sha256", checksum_hex(file.bytes)}});
  out["plan"] = {{"file", "plan.json"}, {"sha256", checksum_hex(registration.plan_text)}};
  out["participants"] = registration.participants;
  out["trials_per_participant"] = protocols::main_trials(protocol);
  out["analysis"] = {{"too_fast_s", registration.too_fast}, {"alpha", registration.alpha}};
  out["orders"] = Json::array();
  for (std::size_t i = 0; i < registration.order_sha256.size(); ++i)
    out["orders"].push_back(
        {{"participant_number", i + 1}, {"sha256", registration.order_sha256[i]}});
  out["simulated_participant"] = {{"version", registration.participant_version},
                                  {"settings_sha256", registration.participant_sha256}};
  out["simulated_studies"] = {
      {"seed", registration.seed},
      {"typical_time_s", registration.typical_time},
      {"studies",
       registration.rehearsals.empty() ? 0 : registration.rehearsals[0].with_effect.studies()}};
  out["hypotheses"] = Json::array();
  for (std::size_t i = 0; i < registration.hypotheses.size(); ++i)
    out["hypotheses"].push_back(
        {{"id", registration.hypotheses[i].id},
         {"with_planned_effect", counts_json(registration.rehearsals[i].with_effect)},
         {"with_no_effect", counts_json(registration.rehearsals[i].without_effect)}});
  out["sessions_so_far"] =
      registration.sessions_so_far ? Json(*registration.sessions_so_far) : Json();
  out["warnings"] = registration.warnings;
  for (std::size_t i = 0; i < texts.size(); ++i)
    out["to_fill_in"].push_back(
        {{"file", files_to_fill_in()[i]}, {"sha256_when_made", checksum_hex(texts[i])}});
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<std::string> filled_in(const std::string& folder) {
  std::vector<std::string> out;
  try {
    const Json in = read_ordered_json(read_member(folder, "registration.json"));
    for (const Json& one : in.at("to_fill_in")) {
      const std::string name = one.at("file");
      if (std::ranges::find(files_to_fill_in(), name) == files_to_fill_in().end()) continue;
      if (checksum_of_member(folder, name) != one.at("sha256_when_made").get<std::string>())
        out.push_back(name);
    }
  } catch (const JsonError& error) {
    throw UsageError((std::filesystem::path(folder) / "registration.json").string() +
                     ": is not what 'palpate register' writes: " + error.what());
  } catch (const Json::exception& error) {
    throw UsageError((std::filesystem::path(folder) / "registration.json").string() +
                     ": is not what 'palpate register' writes: " + error.what());
  }
  return out;
}

Registration read_registration(const std::string& folder) {
  const std::string where = (std::filesystem::path(folder) / "registration.json").string();
  Registration out;
  try {
    const Json in = read_ordered_json(read_member(folder, "registration.json"));
    if (in.at("version") != 1)
      throw std::invalid_argument("expected version 1, found " + json_excerpt(in.at("version")));
    out.made_utc_ns = utc_ns_of(in.at("made_utc"));
    out.program_version = in.at("program_version");
    out.build = in.at("build");
    out.participants = in.at("participants");
    out.too_fast = in.at("analysis").at("too_fast_s");
    out.alpha = in.at("analysis").at("alpha");
    if (!(out.too_fast > 0 && out.too_fast < 1e6 && out.alpha > 0 && out.alpha < 1))
      throw std::invalid_argument("expected too_fast_s above 0 and alpha from 0 to 1");
    for (const Json& order : in.at("orders")) out.order_sha256.push_back(order.at("sha256"));
    out.participant_version = in.at("simulated_participant").at("version");
    out.participant_sha256 = in.at("simulated_participant").at("settings_sha256");
    for (const Json& file : in.at("protocol").at("files"))
      out.files.push_back({file.at("file"), ""});
  } catch (const JsonError& error) {
    throw UsageError(where + ": is not what 'palpate register' writes: " + error.what());
  } catch (const Json::exception& error) {
    throw UsageError(where + ": is not what 'palpate register' writes: " + error.what());
  } catch (const std::invalid_argument& error) {
    throw UsageError(where + ": is not what 'palpate register' writes: " + error.what());
  }
  require_files_below(out.files);
  protocols::StoredFiles stored;
  for (data::ProtocolFile& file : out.files)
    stored[file.name] = file.bytes = read_member(folder, file.name);
  out.protocol =
      protocols::parse_protocol_text(read_member(folder, "protocol.json"),
                                     (std::filesystem::path(folder) / "protocol.json").string(),
                                     stored, protocols::OtherFiles::refuse);
  out.plan_text = read_member(folder, "plan.json");
  try {
    out.plan = analysis::read_plan(out.plan_text);
  } catch (const std::invalid_argument& error) {
    throw UsageError((std::filesystem::path(folder) / "plan.json").string() + ": " + error.what());
  }
  out.hypotheses_text = read_member(folder, "hypotheses.json");
  out.hypotheses = analysis::read_hypotheses(
      out.hypotheses_text, (std::filesystem::path(folder) / "hypotheses.json").string(), {});
  return out;
}

void require_files_below(const std::vector<data::ProtocolFile>& files) {
  std::string faults;
  for (const data::ProtocolFile& file : files) {
    const std::filesystem::path path(file.name);
    const std::filesystem::path plain = path.lexically_normal();
    const bool below = path.is_relative() && !plain.empty() && *plain.begin() != ".." &&
                       plain.has_filename() && is_plain_utf8(file.name) &&
                       file.name.find('\\') == std::string::npos;
    if (!below)
      faults += (faults.empty() ? "" : "\n") + ("the protocol names " + printable(file.name)) +
                ": expected a file in the protocol's folder or below, with a plain name, so that a "
                "registration can hold it; move the file there";
  }
  if (!faults.empty()) throw UsageError(faults);
}

}  // namespace palpate::runner::commands
