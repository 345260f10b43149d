#include "runner/registration/registration.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "data/base/checksum.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/schedule.h"
#include "runner/registration/answers.h"
#include "runner/registration/sealed_folder.h"
#include "runner/study/study_order.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

using Json = nlohmann::ordered_json;
using protocols::ObjectReader;
using protocols::Presence;

constexpr int kVersion = 2;
constexpr const char* kForm = "form.json";

Json counts_json(const VerdictCounts& counts) {
  return {{"corroborated", counts.corroborated},
          {"refuted", counts.refuted},
          {"undecided", counts.undecided}};
}

/// "2026-11-25T08:00:00.000000Z" as ns since 1970.
std::optional<std::int64_t> utc_ns_of(const std::string& text) {
  std::tm time{};
  int micros = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2d.%6dZ", &time.tm_year, &time.tm_mon,
                  &time.tm_mday, &time.tm_hour, &time.tm_min, &time.tm_sec, &micros) != 7)
    return std::nullopt;
  time.tm_year -= 1900;
  time.tm_mon -= 1;
  const std::int64_t ns = (static_cast<std::int64_t>(::timegm(&time)) * 1'000'000 + micros) * 1'000;
  if (ns < 0 || data::format_utc(ns) != text) return std::nullopt;
  return ns;
}

// Limits of what is read; registrations stay far below them.
constexpr std::size_t kMostWord = 1'000, kMostLine = 100'000, kMostFiles = 10'000;
constexpr double kMostCount = 1e9;

/// Elements of a list that is an object each. \param read  called with the reader of each
void read_objects(ObjectReader& reader, const char* key, std::size_t least, std::size_t most,
                  const std::function<void(ObjectReader&)>& read) {
  const nlohmann::json* const list = reader.array(key, least, most, Presence::required);
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    ObjectReader one((*list)[i], protocols::child_pointer(reader.pointer(key), i), reader.faults());
    read(one);
    one.refuse_unknown_keys();
  }
}

VerdictCounts read_counts(ObjectReader& reader, const char* key) {
  VerdictCounts out;
  reader.section(
      key,
      [&](ObjectReader& counts) {
        counts.count("corroborated", out.corroborated, {0, kMostCount});
        counts.count("refuted", out.refuted, {0, kMostCount});
        counts.count("undecided", out.undecided, {0, kMostCount});
      },
      Presence::required);
  return out;
}

/// The values in registration.json that follow from others.
struct Stated {
  std::vector<double> look_alphas;
  std::string protocol_sha256, plan_sha256;
  std::vector<std::string> file_sha256, hypothesis_ids;
};

void read_files(ObjectReader& reader, Registration& out, Stated& stated) {
  std::string file;
  reader.section(
      "protocol",
      [&](ObjectReader& protocol) {
        protocol.text("file", file, kMostWord);
        protocol.text("name", file, kMostWord);
        protocol.checksum("sha256", stated.protocol_sha256);
        read_objects(protocol, "files", 0, kMostFiles, [&](ObjectReader& one) {
          one.text("file", out.files.emplace_back().name, kMostWord);
          one.checksum("sha256", stated.file_sha256.emplace_back());
        });
      },
      Presence::required);
  reader.section(
      "plan",
      [&](ObjectReader& plan) {
        plan.text("file", file, kMostWord);
        plan.checksum("sha256", stated.plan_sha256);
      },
      Presence::required);
}

void read_looks(ObjectReader& analysis, Registration& out, Stated& stated) {
  if (!analysis.has("looks")) return;
  std::vector<std::size_t> at;
  read_objects(analysis, "looks", 1, kMostLooks, [&](ObjectReader& look) {
    const double least = at.empty() ? kFewestParticipants : static_cast<double>(at.back() + 1);
    look.count("participants", at.emplace_back(), {least, static_cast<double>(out.participants)});
    look.number("alpha", stated.look_alphas.emplace_back(), {0, 1}, Presence::required);
  });
  std::string spending;
  analysis.text("spending", spending, kMostWord);
  const auto known = spending_of(spending);
  if (!known)
    analysis.faults().add(
        analysis.pointer("spending"),
        "expected obrien-fleming or pocock, found '" + printable(spending, 60) + "'");
  if (at.empty() || at.back() != out.participants) {
    analysis.faults().add(
        analysis.pointer("looks"),
        "expected the last look at all " + std::to_string(out.participants) + " participants");
  } else if (analysis.faults().empty() && known) {
    out.spending = *known;
    out.looks = analysis::planned_looks(out.spending, out.alpha, at);
  }
}

void read_study(ObjectReader& reader, Registration& out, Stated& stated) {
  std::size_t trials = 0;
  reader.count("participants", out.participants, {kFewestParticipants, kMostParticipants});
  reader.count("trials_per_participant", trials, {1, kMostCount});
  reader.section(
      "analysis",
      [&](ObjectReader& analysis) {
        analysis.number("too_fast_s", out.too_fast, {0, kMostTooFast, "s", true},
                        Presence::required);
        analysis.number("alpha", out.alpha, {0, 1, "", true}, Presence::required);
        read_looks(analysis, out, stated);
      },
      Presence::required);
  read_objects(reader, "orders", out.participants, out.participants, [&](ObjectReader& order) {
    std::size_t number = 0;
    const int last = out.order_sha256.empty() ? 0 : out.order_sha256.rbegin()->first;
    order.count("participant_number", number, {last + 1.0, kHighestNumber});
    order.checksum("sha256", out.order_sha256[static_cast<int>(number)]);
  });
}

void read_simulation(ObjectReader& reader, Registration& out, Stated& stated) {
  reader.section(
      "simulated_participant",
      [&](ObjectReader& one) {
        one.integer("version", out.participant_version, {1, 1000}, Presence::required);
        one.checksum("settings_sha256", out.participant_sha256);
      },
      Presence::required);
  std::size_t studies = 0;
  reader.section(
      "simulated_studies",
      [&](ObjectReader& one) {
        one.seed("seed", out.seed);
        one.number("typical_time_s", out.typical_time, {0, 1e6, "s"}, Presence::required);
        one.count("studies", studies, {0, kMostCount});
      },
      Presence::required);
  read_objects(reader, "hypotheses", 1, 100, [&](ObjectReader& one) {
    one.text("id", stated.hypothesis_ids.emplace_back(), kMostWord);
    out.rehearsals.push_back(
        {read_counts(one, "with_planned_effect"), read_counts(one, "with_no_effect")});
  });
}

/// Until version 1 the checksums of the texts that the lab fills in, since then form.json.
void read_texts_as_made(ObjectReader& reader, int version, Registration& out) {
  if (version != 1) return;
  out.sha256_when_made.resize(files_to_fill_in().size());
  read_objects(reader, "to_fill_in", 0, files_to_fill_in().size(), [&](ObjectReader& one) {
    std::string file, sha256;
    one.text("file", file, kMostWord);
    one.checksum("sha256_when_made", sha256);
    const auto at = std::ranges::find(files_to_fill_in(), file);
    if (at == files_to_fill_in().end()) {
      one.faults().add(one.pointer("file"), "expected " + files_to_fill_in()[0] + " or " +
                                                files_to_fill_in()[1] + ", found '" +
                                                printable(file, 60) + "'");
    } else {
      out.sha256_when_made[static_cast<std::size_t>(at - files_to_fill_in().begin())] = sha256;
    }
  });
}

/// \throws InputError with every fault
Stated read_statement(const std::string& text, const std::string& path, Registration& out) {
  protocols::FaultList faults(path);
  const nlohmann::json json = protocols::read_json(text, faults);
  ObjectReader reader(json, "", faults);
  Stated stated;
  int version = 1;
  reader.integer("version", version, {1, kVersion}, Presence::required);
  std::string made;
  reader.text("made_utc", made, kMostWord);
  if (const auto ns = utc_ns_of(made)) {
    out.made_utc_ns = *ns;
  } else if (reader.has("made_utc")) {
    faults.add("/made_utc", "expected a time such as \"2026-11-25T08:00:00.000000Z\", found '" +
                                printable(made, 60) + "'");
  }
  reader.text("program_version", out.program_version, kMostWord);
  reader.text("build", out.build, kMostWord);
  read_files(reader, out, stated);
  read_study(reader, out, stated);
  read_simulation(reader, out, stated);
  reader.count("sessions_so_far", out.sessions_so_far, {0, kMostCount});
  if (const auto* list = reader.array("warnings", 0, kMostFiles, Presence::required)) {
    for (std::size_t i = 0; i < list->size(); ++i)
      protocols::read_text((*list)[i], protocols::child_pointer("/warnings", i),
                           out.warnings.emplace_back(), kMostLine, faults);
  }
  read_texts_as_made(reader, version, out);
  reader.refuse_unknown_keys();
  faults.throw_if_any();
  return stated;
}

std::vector<std::string> contradictions_of(const Registration& read, const Stated& stated) {
  std::vector<std::string> out;
  const auto compare = [&](const std::string& file, const std::string& bytes,
                           const std::string& sha256) {
    if (checksum_hex(bytes) != sha256)
      out.push_back(file + " is not the one that registration.json names: SHA-256 " +
                    checksum_hex(bytes).substr(0, 12) + "..., named " + sha256.substr(0, 12) +
                    "...");
  };
  compare("protocol.json", read.protocol.source_text, stated.protocol_sha256);
  compare("plan.json", read.plan_text, stated.plan_sha256);
  for (std::size_t i = 0; i < read.files.size(); ++i)
    compare(printable(read.files[i].name, 200), read.files[i].bytes, stated.file_sha256[i]);
  for (std::size_t k = 0; k < read.looks.size(); ++k)
    if (std::abs(read.looks[k].alpha - stated.look_alphas[k]) > 1e-9)
      out.push_back("registration.json states another alpha of the look at " +
                    std::to_string(read.looks[k].participants) +
                    " participants than its spending gives");
  const int last = read.order_sha256.rbegin()->first;
  if (read.protocol.groups.rule != GroupAssignment::Rule::given &&
      static_cast<std::size_t>(last) != read.participants)
    out.push_back("registration.json has the order of number " + std::to_string(last) + ", of " +
                  std::to_string(read.participants) +
                  " participants, whose numbers the protocol gives in turn");
  std::vector<std::string> ids;
  for (const analysis::Hypothesis& one : read.hypotheses) ids.push_back(one.id);
  if (ids != stated.hypothesis_ids)
    out.push_back("hypotheses.json has other hypotheses than registration.json names");
  return out;
}

}  // namespace

void VerdictCounts::add(analysis::Verdict verdict) {
  corroborated += verdict == analysis::Verdict::corroborated;
  refuted += verdict == analysis::Verdict::refuted;
  undecided += verdict == analysis::Verdict::undecided;
}

const char* to_string(analysis::Spending spending) {
  return spending == analysis::Spending::pocock ? "pocock" : "obrien-fleming";
}

std::optional<analysis::Spending> spending_of(const std::string& name) {
  for (const auto one : {analysis::Spending::obrien_fleming, analysis::Spending::pocock})
    if (name == to_string(one)) return one;
  return std::nullopt;
}

std::vector<int> planned_numbers(const Registration& registration) {
  std::vector<int> numbers;
  for (const auto& [number, sha256] : registration.order_sha256) numbers.push_back(number);
  return numbers;
}

double alpha_at(const Registration& registration, std::size_t participants) {
  if (registration.looks.empty()) return registration.alpha;
  const auto at =
      std::ranges::find(registration.looks, participants, &analysis::Look::participants);
  return at == registration.looks.end() ? std::nan("") : at->alpha;
}

const std::vector<std::string>& files_to_fill_in() {
  static const std::vector<std::string> files = {"registration.md", "osf.json"};
  return files;
}

std::string registration_json(const Registration& registration) {
  const protocols::Protocol& protocol = registration.protocol;
  Json out;
  out["version"] = kVersion;
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
  out["trials_per_participant"] = study::planned_trials(protocol);
  out["analysis"] = {{"too_fast_s", registration.too_fast}, {"alpha", registration.alpha}};
  for (const analysis::Look& look : registration.looks)
    out["analysis"]["looks"].push_back(
        {{"participants", look.participants}, {"alpha", look.alpha}});
  if (!registration.looks.empty()) out["analysis"]["spending"] = to_string(registration.spending);
  out["orders"] = Json::array();
  for (const auto& [number, sha256] : registration.order_sha256)
    out["orders"].push_back({{"participant_number", number}, {"sha256", sha256}});
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
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string registration_digest(const std::string& folder) {
  return checksum_hex(checksum_lines(folder, files_to_fill_in()));
}

std::string read_digest(const std::string& option) {
  if (!is_checksum(option))
    throw UsageError(
        "--digest: expected the 64 digits (0-9, a-f) that 'palpate register' printed, "
        "found '" +
        printable(option, 80) + "'");
  return option;
}

FilledIn filled_in(const std::string& folder, const Registration& registration) {
  FilledIn out;
  const std::string markdown = read_member(folder, files_to_fill_in()[0]);
  const std::string osf = read_member(folder, files_to_fill_in()[1]);
  if (!registration.form) {
    out.comparable = false;
    if (checksum_hex(markdown) != registration.sha256_when_made[0])
      out.files.push_back(files_to_fill_in()[0]);
    if (checksum_hex(osf) != registration.sha256_when_made[1])
      out.files.push_back(files_to_fill_in()[1]);
    return out;
  }
  const Form& form = *registration.form;
  if (markdown != markdown_as_made(form, registration.digest))
    out.files.push_back(files_to_fill_in()[0]);
  if (osf != osf_as_made(form, registration.digest)) out.files.push_back(files_to_fill_in()[1]);
  out.changes = markdown_changes(form, registration.digest, markdown);
  for (std::string& one : osf_changes(form, registration.digest, osf))
    out.changes.push_back(std::move(one));
  return out;
}

Registration parse_statement(const std::string& text, const std::string& file) {
  Registration out;
  read_statement(text, file, out);
  return out;
}

Registration read_registration(const std::string& folder) {
  const auto path = [&](const char* name) {
    return (std::filesystem::path(folder) / name).string();
  };
  Registration out;
  const Stated stated =
      read_statement(read_member(folder, "registration.json"), path("registration.json"), out);
  if (out.sha256_when_made.empty()) out.form = read_form(read_member(folder, kForm), path(kForm));
  require_files_below(out.files);
  protocols::StoredFiles stored;
  for (data::ProtocolFile& file : out.files)
    stored[file.name] = file.bytes = read_member(folder, file.name);
  out.protocol =
      protocols::parse_protocol_text(read_member(folder, "protocol.json"), path("protocol.json"),
                                     stored, protocols::OtherFiles::refuse);
  require_registrable(out.protocol, path("protocol.json"));
  out.plan_text = read_member(folder, "plan.json");
  out.plan = analysis::read_plan(out.plan_text, path("plan.json"));
  out.hypotheses_text = read_member(folder, "hypotheses.json");
  out.hypotheses = analysis::read_hypotheses(out.hypotheses_text, path("hypotheses.json"), {});
  out.contradictions = contradictions_of(out, stated);
  out.digest = registration_digest(folder);
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

}  // namespace palpate::runner::registration
