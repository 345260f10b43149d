// The check as text, JSON and a page.

#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/report/html_page.h"
#include "analysis/text.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "runner/registration/deviations.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

using analysis::escaped;
using analysis::escaped_sentence;

const char* word_of(Finding finding) {
  switch (finding) {
    case Finding::as_registered:
      return "as registered";
    case Finding::deviation:
      return "DEVIATION";
    case Finding::note:
      break;
  }
  return "note";
}

const char* word_of(const std::optional<bool>& holds) {
  return !holds ? "undefined" : *holds ? "holds" : "does not hold";
}

std::string number_text(double value) {
  return std::isnan(value) ? "undefined" : nlohmann::json(value).dump();
}

std::string made_on(const Registration& registered) {
  return data::format_utc(registered.made_utc_ns).substr(0, 10);
}

/// "paired.cone.p_holm = 0.012, alpha = 0.05"
std::string numbers_of(const analysis::Judgement& judgement) {
  std::string out;
  for (const auto& [name, value] : judgement.numbers)
    out += (out.empty() ? "" : ", ") + name + " = " + number_text(value);
  return out;
}

void put_hypothesis(const analysis::Hypothesis& one, const analysis::Judgement& judgement,
                    std::string& out) {
  const std::string verdict = analysis::to_string(judgement.verdict);
  const bool clear = judgement.verdict == analysis::Verdict::corroborated;
  const bool refuted = judgement.verdict == analysis::Verdict::refuted;
  out += clear ? "<li class=\"clear\">" : refuted ? "<li class=\"slower\">" : "<li>";
  out += "<b>" + escaped(one.id) + "</b><span class=\"value\">" + verdict + "</span><small>" +
         escaped_sentence(printable(one.text, 5000)) + "</small></li>\n";
}

/// The conditions of a hypothesis with its numbers.
analysis::Table judged_conditions(const analysis::Hypothesis& one,
                                  const analysis::Judgement& judgement, const std::string& label) {
  analysis::Table table;
  table.caption = one.id + ": " + analysis::to_string(judgement.verdict) +
                  (label.empty() ? "" : " (" + label + ")");
  table.header = {"", "condition or number", "value"};
  table.n_names = 3;
  table.rows = {{"corroborated if", one.corroborated, word_of(judgement.corroborated)},
                {"refuted if", one.refuted, word_of(judgement.refuted)}};
  for (const auto& [name, value] : judgement.numbers)
    table.rows.push_back({"number", name, number_text(value)});
  return table;
}

analysis::Table points_of(const StudyCheck& check) {
  analysis::Table table;
  table.caption = "Points" + (check.label.empty() ? "" : " (" + check.label + ")");
  table.header = {"point", "", "what was found"};
  table.n_names = 3;
  for (const CheckPoint& point : check.points)
    table.rows.push_back(
        {point.title,
         point.finding == Finding::as_registered ? "as\u00a0registered" : word_of(point.finding),
         point.sentence});
  return table;
}

void put_evidence(const CheckPoint& point, std::string& out) {
  if (point.evidence.empty()) return;
  out += "<h3>" + escaped(point.title) + ": evidence</h3>\n";
  std::vector<std::string> lines;
  for (const std::string& line : point.evidence) lines.push_back(printable(line));
  analysis::put_list(out, lines);
}

}  // namespace

std::string check_text(const StudyCheck& check, const Registration& registered) {
  std::string out = conclusion_of(check) + ": " + registered.protocol.name + ", " +
                    analysis::counted(check.participants, "participant", "participants") +
                    ", registration of " + made_on(registered) + "\nDigest of the registration " +
                    registered.digest + "\n";
  if (!check.label.empty()) out += check.label + "\n";
  out += "\n";
  for (const CheckPoint& point : check.points) {
    out += analysis::pad_right(word_of(point.finding), 15) + analysis::pad_right(point.id, 14) +
           printable(point.sentence) + "\n";
    for (const std::string& line : point.evidence)
      out += std::string(31, ' ') + printable(line) + "\n";
  }
  out += "\nHypotheses" + (check.label.empty() ? "" : " (" + check.label + ")") + "\n";
  for (const auto& [one, judgement] : check.hypotheses) {
    out += "  " + one.id + "  " + analysis::to_string(judgement.verdict) + ": " +
           printable(one.text) + "\n";
    out +=
        "      corroborated if " + one.corroborated + ": " + word_of(judgement.corroborated) + "\n";
    out += "      refuted if " + one.refuted + ": " + word_of(judgement.refuted) + "\n";
    out += "      " + numbers_of(judgement) + "\n";
  }
  return out;
}

std::string check_json(const StudyCheck& check, const Registration& registered) {
  using Json = nlohmann::ordered_json;
  Json out;
  out["version"] = 1;
  out["simulated"] = check.label.empty() ? Json(false) : Json(check.label);
  out["program_version"] = PALPATE_VERSION;
  out["registration"] = {{"made_utc", data::format_utc(registered.made_utc_ns)},
                         {"digest", registered.digest},
                         {"protocol", registered.protocol.name},
                         {"protocol_sha256", registered.protocol.sha256},
                         {"participants", registered.participants}};
  out["deviations"] = check.deviations();
  out["points"] = Json::array();
  for (const CheckPoint& point : check.points) {
    const char* finding =
        point.finding == Finding::deviation ? "deviation" : word_of(point.finding);
    out["points"].push_back({{"id", point.id},
                             {"title", point.title},
                             {"finding", finding},
                             {"sentence", point.sentence},
                             {"evidence", point.evidence}});
  }
  out["hypotheses"] = Json::array();
  const auto holds = [](const std::optional<bool>& value) { return value ? Json(*value) : Json(); };
  for (const auto& [one, judgement] : check.hypotheses) {
    Json numbers = Json::object();
    for (const auto& [name, value] : judgement.numbers)
      numbers[name] = std::isnan(value) ? Json() : Json(value);
    out["hypotheses"].push_back(
        {{"id", one.id},
         {"text", one.text},
         {"verdict", analysis::to_string(judgement.verdict)},
         {"corroborated",
          {{"condition", one.corroborated}, {"holds", holds(judgement.corroborated)}}},
         {"refuted", {{"condition", one.refuted}, {"holds", holds(judgement.refuted)}}},
         {"numbers", numbers}});
  }
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string check_html(const StudyCheck& check, const Registration& registered) {
  analysis::HtmlPage page(conclusion_of(check), check.label);
  if (!check.label.empty())
    page.put_banner(check.label + ": this tries the way of a study; no person took part in it.");
  const protocols::Protocol& protocol = registered.protocol;
  page.above_title() +=
      "<p class=\"study\">" +
      escaped(printable(protocol.title.empty() ? protocol.name : protocol.title, 400)) + "</p>\n";
  std::string& lead = page.below_title();
  lead += "<p class=\"lead\">" +
          escaped(analysis::counted(check.participants, "participant", "participants") +
                  ", held against the registration of " + made_on(registered) + ".") +
          "</p>\n";
  std::vector<std::string> deviations;
  for (const CheckPoint& point : check.points) {
    if (point.finding == Finding::deviation)
      deviations.push_back(printable(point.title + ": " + point.sentence, 4000));
  }
  if (!deviations.empty()) {
    lead += "<div class=\"warnings\" role=\"note\" aria-label=\"Deviations\">\n";
    analysis::put_list(lead, deviations);
    lead += "</div>\n";
  }

  page.begin_section("hypotheses", "Hypotheses", "Hypotheses");
  page.body() += "<ul class=\"cards\">\n";
  for (const auto& [one, judgement] : check.hypotheses) put_hypothesis(one, judgement, page.body());
  page.body() += "</ul>\n";
  for (const auto& [one, judgement] : check.hypotheses)
    analysis::put_table(page.body(), judged_conditions(one, judgement, check.label));
  page.put_note(
      "Corroborated: the first condition holds and the second does not. Refuted: the second holds "
      "and the first does not. Else undecided. The conditions are the registered ones.");
  page.end_section();

  page.begin_section("points", "Point by point", "Points");
  analysis::put_table(page.body(), points_of(check));
  for (const CheckPoint& point : check.points) put_evidence(point, page.body());
  page.end_section();

  page.begin_section("registration", "What was registered", "Registration");
  analysis::Table table;
  table.caption = "Registration";
  table.header = {"", "registered"};
  table.n_names = 2;
  table.rows = {{"made", data::format_utc(registered.made_utc_ns).substr(0, 19) + "Z"},
                {"digest", registered.digest},
                {"protocol", protocol.name},
                {"SHA-256 of the protocol", protocol.sha256},
                {"participants", std::to_string(registered.participants)},
                {"trials of each", (study::has_adaptive_blocks(protocol) ? "about " : "") +
                                       std::to_string(study::planned_trials(protocol))},
                {"too fast", number_text(registered.too_fast) + " s"},
                {"alpha", number_text(registered.alpha)},
                {"palpate", registered.program_version + ", " + registered.build}};
  analysis::put_table(page.body(), table);
  page.end_section();
  return page.html("palpate " PALPATE_VERSION ".");
}

}  // namespace palpate::runner::registration
