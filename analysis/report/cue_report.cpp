#include "analysis/report/cue_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/report/html_page.h"
#include "analysis/report/inference_json.h"
#include "analysis/report/report.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/describe.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

std::string label_of(const CueAnalysis& analysis) {
  return analysis.simulated ? simulated_label(Simulated::yes) : "";
}

std::string labelled(const CueAnalysis& analysis, const std::string& what) {
  const std::string label = label_of(analysis);
  return what + (label.empty() ? "" : " (" + label + ")");
}

std::string of_level(const CueAnalysis& analysis) {
  return analysis.level_name + (analysis.unit == "1" ? "" : " (" + analysis.unit + ")");
}

double change_percent(double log_ratio) { return 100 * (std::exp(log_ratio) - 1); }

/// "0.012 [-0.030, 0.054], t(11) = 0.62, p = 0.548".
std::string weight_words(const CueTest& test) {
  std::string out = fixed(test.mean, 3);
  if (const auto& ci = test.test.log_ratio_ci95)
    out += " [" + fixed(ci->low, 3) + ", " + fixed(ci->high, 3) + "]";
  if (test.test.p) out += ", " + test_text(test.test);
  return out;
}

/// "3.1 % higher [-2.0, 8.4 %], t(11) = 1.20, p = 0.255".
std::string ratio_words(const CueTest& test) {
  const double change = change_percent(test.mean);
  std::string out = fixed(std::abs(change), 1) + " % " + (change < 0 ? "lower" : "higher");
  if (const auto& ci = test.test.log_ratio_ci95) {
    out += " [" + fixed(change_percent(ci->low), 1) + ", " + fixed(change_percent(ci->high), 1) +
           " %]";
  }
  if (test.test.p) out += ", " + test_text(test.test);
  return out;
}

bool is_below(const CueTest& test) { return test.test.p && *test.test.p < kAlpha && test.mean < 0; }

bool is_different(const CueTest& test) { return test.test.p && *test.test.p < kAlpha; }

/// The results of the group, each in a sentence. Agreement with one prediction alone says little
/// (Scarfe 2022), so none says that people are optimal.
std::vector<std::string> cue_sentences(const CueAnalysis& analysis) {
  if (analysis.participants.empty()) return {};
  std::vector<std::string> out;
  out.push_back("Weight of the seen, observed less predicted: " + weight_words(analysis.weight) +
                (is_different(analysis.weight) ? ": it differs from the prediction."
                                               : ": no difference was found."));
  out.push_back(
      "JND with both cues, beside the predicted one: " + ratio_words(analysis.jnd_predicted) + ".");
  out.push_back(
      "JND with both cues, beside that of the better cue: " + ratio_words(analysis.jnd_better) +
      (is_below(analysis.jnd_better) ? ": together they are better than the better one alone."
                                     : ": a gain over the better cue was not found."));
  if (!analysis.models.empty()) {
    const auto best = std::ranges::min_element(analysis.models, {}, &CueModelSum::aic);
    out.push_back("Least AIC over all participants: " + std::string(to_string(best->model)) +
                  ", which describes " + std::to_string(best->best_for) + " of " +
                  counted(analysis.participants.size(), "participant", "participants") + " best.");
  }
  return out;
}

constexpr const char* kHowTo =
    "Of two intervals the larger is chosen. In blocks with both cues the standard is seen at "
    "S + D/2 and felt at S - D/2, and the comparison is congruent. The weight of the seen is 1/2 "
    "plus the slope of the points of equality over the conflict D. With independent noise the "
    "least variance has the weight s_h^2 / (s_h^2 + s_v^2), from the blocks with one cue. That a "
    "prediction agrees with the data does not show that it is right: its rivals may agree as "
    "well, so each is fitted to all answers.";

constexpr const char* kJndNote =
    "JND: half the distance of the levels of 25 and 75 %. Better cue: the smaller of the two JNDs "
    "of a participant, less the bias that a parametric bootstrap finds in taking the smaller of "
    "two "
    "estimates, about half of it. One lapse rate for all blocks of a participant.";

Table participants_table(const CueAnalysis& analysis) {
  Table table;
  table.caption = labelled(analysis, "Weights and JNDs of " + of_level(analysis));
  table.header = {"participant", "weight of the seen", "predicted",  "JND felt",  "seen",
                  "both",        "predicted",          "better cue", "best model"};
  table.n_remarks = 1;
  for (const CueParticipant& one : analysis.participants) {
    table.rows.push_back({one.participant, fixed(one.weight_visual, 3),
                          fixed(one.weight_predicted, 3), short_number(one.jnd_haptic),
                          short_number(one.jnd_visual), short_number(one.jnd_both),
                          short_number(one.jnd_predicted), short_number(one.jnd_better),
                          analysis.models.empty() ? kMissing : to_string(one.best)});
  }
  table.notes.emplace_back(kJndNote);
  for (const auto& [participant, reason] : analysis.left_out)
    table.notes.push_back("Left out: " + printable(participant, 40) + ": " +
                          printable(reason, 200) + ".");
  return table;
}

Table models_table(const CueAnalysis& analysis) {
  Table table;
  table.caption = labelled(analysis, "Models of all answers");
  table.header = {"model", "AIC, sum", "participants", "meaning"};
  table.n_remarks = 1;
  const auto meaning = [](CueModel model) {
    switch (model) {
      case CueModel::optimal:
        return "least variance";
      case CueModel::best_cue:
        return "the better cue alone";
      case CueModel::equal_weights:
        return "one half each";
      case CueModel::free_weight:
        return "any weight, least variance";
      case CueModel::free:
        return "any weight, any variance";
      case CueModel::switching:
        return "one cue alone, by trial";
      case CueModel::causal:
        return "both as far as they seem one thing";
    }
    return "";
  };
  for (const CueModelSum& sum : analysis.models)
    table.rows.push_back({to_string(sum.model), fixed(sum.aic, 1), std::to_string(sum.best_for),
                          meaning(sum.model)});
  table.notes.emplace_back(
      "participants: those whose AIC is the least with this model. Differences of the sum below "
      "some 10 say little.");
  return table;
}

Figure new_cue_figure(const CueAnalysis& analysis, std::string id, std::string title) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = std::move(title);
  figure.subtitle = counted(analysis.participants.size(), "participant", "participants");
  figure.label = label_of(analysis);
  return figure;
}

/// Points of equality less the middle of the standard, over the conflict.
Figure pse_figure(const CueAnalysis& analysis) {
  Figure figure = new_cue_figure(analysis, "cues-pse", "Points of equality over the conflict");
  double most = 0, highest = 0, observed = 0, predicted = 0;
  for (const CueParticipant& one : analysis.participants) {
    observed += one.weight_visual;
    predicted += one.weight_predicted;
    for (const CuePse& point : one.points) {
      most = std::max(most, std::abs(point.conflict));
      highest = std::max(highest, std::abs(point.pse - point.middle));
    }
  }
  const auto n = static_cast<double>(analysis.participants.size());
  observed /= n;
  predicted /= n;
  highest = std::max(highest, most / 2);
  Panel panel;
  panel.width = 560;
  panel.height = 380;
  const std::string unit = analysis.unit == "1" ? "" : " (" + analysis.unit + ")";
  panel.x = linear_axis(-1.15 * most, 1.15 * most, "seen less felt" + unit);
  panel.y = linear_axis(-1.05 * highest, 1.05 * highest, "PSE less middle" + unit);
  const auto line = [&](double weight, Role role, bool dashed, double width) {
    const double end = std::min(1.15 * most, highest / std::max(std::abs(weight - 0.5), 1e-9));
    Mark mark = line_mark(role, {-end, end}, {-end * (weight - 0.5), end * (weight - 0.5)}, width);
    mark.dashed = dashed;
    panel.marks.push_back(std::move(mark));
  };
  line(0, Role::grid, true, 1.5);
  line(1, Role::grid, true, 1.5);
  panel.marks.push_back(text_mark(Role::soft, 1.02 * most, 0.5 * most, "seen alone", 11));
  panel.marks.push_back(text_mark(Role::soft, 1.02 * most, -0.5 * most, "felt alone", 11));
  for (std::size_t i = panel.marks.size() - 2; i < panel.marks.size(); ++i)
    panel.marks[i].anchor = 1;
  for (const CueParticipant& one : analysis.participants) {
    for (const CuePse& point : one.points) {
      Mark mark = symbol(Role::soft, MarkerShape::circle, point.conflict, point.pse - point.middle,
                         3.5, one.participant + ": PSE " + short_number(point.pse));
      mark.participant = one.participant;
      mark.opacity = 0.65;
      panel.marks.push_back(std::move(mark));
    }
  }
  line(predicted, Role::amber, true, 2.5);
  line(observed, Role::point, false, 2.5);
  figure.panels.push_back(std::move(panel));
  figure.legend = {{"mean of the observed weights", Role::point, MarkerShape::dash},
                   {"mean of the predicted ones", Role::amber, MarkerShape::dash},
                   {"participants", Role::soft, MarkerShape::circle}};
  figure.notes = {"Slope: weight of the seen less one half."};
  figure.description =
      "Mean weight of the seen " + fixed(observed, 3) + ", predicted " + fixed(predicted, 3) + ".";
  return figure;
}

Figure jnd_figure(const CueAnalysis& analysis) {
  Figure figure = new_cue_figure(analysis, "cues-jnd", "JNDs felt, seen and with both");
  struct Place {
    const char* name;
    double CueParticipant::*value;
    Role role;
  };
  constexpr std::array kPlaces{Place{"felt", &CueParticipant::jnd_haptic, Role::ray},
                               Place{"seen", &CueParticipant::jnd_visual, Role::third},
                               Place{"both", &CueParticipant::jnd_both, Role::point},
                               Place{"predicted", &CueParticipant::jnd_predicted, Role::amber}};
  std::vector<std::string> names;
  double low = INFINITY, high = 0;
  for (const Place& place : kPlaces) {
    names.emplace_back(place.name);
    for (const CueParticipant& one : analysis.participants) {
      low = std::min(low, one.*place.value);
      high = std::max(high, one.*place.value);
    }
  }
  Panel panel;
  panel.width = 560;
  panel.height = 360;
  panel.x = names_axis(names, names.size(), "");
  panel.y =
      log_axis(std::log10(low) - 0.05, std::log10(high) + 0.05, "JND of " + of_level(analysis));
  for (const CueParticipant& one : analysis.participants) {
    std::vector<double> x, y;
    for (std::size_t i = 0; i < kPlaces.size(); ++i) {
      x.push_back(static_cast<double>(i) + 0.5);
      y.push_back(std::log10(one.*kPlaces[i].value));
    }
    Mark way = line_mark(Role::grid, x, y, 1);
    way.participant = one.participant;
    panel.marks.push_back(std::move(way));
    for (std::size_t i = 0; i < kPlaces.size(); ++i) {
      Mark mark = symbol(Role::soft, MarkerShape::circle, x[i], y[i], 3,
                         one.participant + ": " + short_number(one.*kPlaces[i].value));
      mark.participant = one.participant;
      mark.opacity = 0.6;
      panel.marks.push_back(std::move(mark));
    }
  }
  std::vector<std::string> means;
  for (std::size_t i = 0; i < kPlaces.size(); ++i) {
    std::vector<double> logs;
    for (const CueParticipant& one : analysis.participants)
      logs.push_back(std::log(one.*kPlaces[i].value));
    const double x = static_cast<double>(i) + 0.5, middle = mean(logs);
    const std::string words = std::string(kPlaces[i].name) + ": " + short_number(std::exp(middle));
    means.push_back(words);
    if (const std::optional<double> sd = standard_deviation(logs)) {
      const TTest test = t_test(logs);
      if (test.log_ratio_ci95)
        add_interval(panel, kPlaces[i].role, x, test.log_ratio_ci95->low / std::numbers::ln10,
                     test.log_ratio_ci95->high / std::numbers::ln10, words);
    }
    panel.marks.push_back(
        symbol(kPlaces[i].role, MarkerShape::square, x, middle / std::numbers::ln10, 6, words));
  }
  figure.panels.push_back(std::move(panel));
  figure.notes = {
      "Squares: geometric means over participants with their 95 % intervals (t). "
      "Predicted: of independent estimates with the least variance."};
  figure.description = "Geometric means: " + joined(means) + ".";
  return figure;
}

Json test_json(const CueTest& test) {
  Json out;
  put_status(out, test.test.undefined);
  out["mean"] = number(test.test.undefined.empty() ? std::optional(test.mean) : std::nullopt);
  put_interval(out, "ci95", test.test.log_ratio_ci95);
  out["t"] = number(test.test.t);
  out["df"] = number(test.test.df);
  out["p"] = number(test.test.p);
  return out;
}

std::string cue_headline(const CueAnalysis& analysis) {
  if (analysis.participants.empty()) return "No participant has figures for both cues";
  double weight = 0;
  for (const CueParticipant& one : analysis.participants) weight += one.weight_visual;
  return "What is seen weighs " +
         fixed(100 * weight / static_cast<double>(analysis.participants.size()), 0) +
         " % beside what is felt";
}

}  // namespace

std::string cue_text(const CueAnalysis& analysis) {
  std::string out;
  if (const std::string label = label_of(analysis); !label.empty())
    out += paragraph_text(label + ": the answers below are those of a model.") + "\n";
  out += paragraph_text(cue_headline(analysis) + ".");
  for (const std::string& sentence : cue_sentences(analysis)) out += paragraph_text(sentence);
  out += "\n" + table_text(participants_table(analysis));
  if (!analysis.models.empty()) out += "\n" + table_text(models_table(analysis));
  return out;
}

std::string cue_json(const CueAnalysis& analysis, const CueSource& source) {
  Json cues;
  cues["participants"] = Json::array();
  for (const CueParticipant& one : analysis.participants) {
    Json points = Json::array();
    for (const CuePse& point : one.points)
      points.push_back({{"conflict", number(point.conflict)},
                        {"middle", number(point.middle)},
                        {"pse", number(point.pse)},
                        {"se", number(point.se)}});
    Json aics = Json::object();
    for (std::size_t m = 0; m < analysis.models.size(); ++m)
      aics[to_string(static_cast<CueModel>(m))] = number(one.models[m].aic());
    cues["participants"].push_back(
        {{"participant", one.participant},
         {"weight_visual", number(one.weight_visual)},
         {"weight_predicted", number(one.weight_predicted)},
         {"jnd_haptic", number(one.jnd_haptic)},
         {"jnd_visual", number(one.jnd_visual)},
         {"jnd_both", number(one.jnd_both)},
         {"jnd_predicted", number(one.jnd_predicted)},
         {"jnd_better", number(one.jnd_better)},
         {"points", std::move(points)},
         {"aic", std::move(aics)},
         {"best_model", analysis.models.empty() ? Json(nullptr) : Json(to_string(one.best))}});
  }
  cues["left_out"] = Json::array();
  for (const auto& [participant, reason] : analysis.left_out)
    cues["left_out"].push_back({{"participant", participant}, {"reason", reason}});
  cues["weight_observed_minus_predicted"] = test_json(analysis.weight);
  cues["log_jnd_both_by_predicted"] = test_json(analysis.jnd_predicted);
  cues["log_jnd_both_by_better"] = test_json(analysis.jnd_better);
  cues["models"] = Json::array();
  for (const CueModelSum& sum : analysis.models)
    cues["models"].push_back(
        {{"name", to_string(sum.model)}, {"aic", number(sum.aic)}, {"best_for", sum.best_for}});
  const Json out = {
      {"program_version", source.program_version},
      {"simulated", analysis.simulated},
      {"protocol_sha256", source.protocol_sha256},
      {"level", analysis.level_name},
      {"unit", analysis.unit},
      {"settings", {{"resamples", analysis.settings.resamples}, {"seed", analysis.settings.seed}}},
      {"cues", std::move(cues)}};
  return out.dump(2) + "\n";
}

std::vector<Figure> cue_figures(const CueAnalysis& analysis) {
  if (analysis.participants.empty()) return {};
  return {pse_figure(analysis), jnd_figure(analysis)};
}

std::string cue_html(const CueAnalysis& analysis, const CueSource& source) {
  const std::string label = label_of(analysis);
  HtmlPage page(cue_headline(analysis), label);
  if (!label.empty())
    page.put_banner(label + ": the answers here are those of a model, not of humans.");
  page.below_title() += "<p>" + escaped_sentence(kHowTo) + "</p>\n";
  put_list(page.below_title(), cue_sentences(analysis));
  std::vector<std::string> codes;
  for (const CueParticipant& one : analysis.participants) codes.push_back(one.participant);
  const std::vector<Figure> figures = cue_figures(analysis);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    page.begin_section(figures[i].id, figures[i].title, i == 0 ? "Weights" : "JNDs");
    page.put_figure(figures[i], codes);
    page.end_section();
  }
  page.begin_section("participants", "Participants", "Participants");
  put_table(page.body(), participants_table(analysis));
  page.end_section();
  if (!analysis.models.empty()) {
    page.begin_section("models", "Rival models", "Models");
    put_table(page.body(), models_table(analysis));
    page.end_section();
  }
  page.begin_section("source", "Source and settings", "Source");
  Table table;
  table.caption = labelled(analysis, "Source");
  table.header = {"what", "value"};
  table.n_names = 2;
  table.rows = {{"file", printable(source.file, 400)},
                {"protocol", printable(source.protocol, 200)},
                {"protocol SHA-256", source.protocol_sha256},
                {"resamples for the better cue", std::to_string(analysis.settings.resamples)},
                {"seed", std::to_string(analysis.settings.seed)}};
  put_table(page.body(), table);
  page.end_section();
  return page.html("palpate " + source.program_version + ".");
}

}  // namespace palpate::analysis
