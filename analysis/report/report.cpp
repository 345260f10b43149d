#include "analysis/report/report.h"

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/html_page.h"
#include "analysis/report/inference_json.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kPageWidth = 100;
constexpr std::size_t kNameColumns = 24;   // largest width of a name in a table
constexpr std::size_t kValueColumns = 70;  // largest width of a text in the provenance table

Json times(const TimesCell& cell) {
  Json out;
  put_status(out, cell.n_participants == 0   ? "no trial has a usable time"
                  : cell.n_participants == 1 ? "one participant has no standard deviation"
                                             : "");
  out["n_participants"] = cell.n_participants;
  out["n_trials"] = cell.n_trials;
  out["mean_of_participant_means"] = number(cell.mean_of_participant_means);
  out["sd_of_participant_means"] = number(cell.sd_of_participant_means);
  out["mean_of_participant_medians"] = number(cell.mean_of_participant_medians);
  out["geomean_of_participant_geomeans"] = number(cell.geomean_of_participant_geomeans);
  out["mean_of_participant_mean_logs"] = number(cell.mean_of_participant_mean_logs);
  out["sd_of_participant_mean_logs"] = number(cell.sd_of_participant_mean_logs);
  return out;
}

std::string repeated(const char* what, std::size_t times) {
  std::string out;
  for (std::size_t i = 0; i < times; ++i) out += what;
  return out;
}

/// Appends a paragraph in lines of at most kPageWidth columns; a longer word is cut.
void put_wrapped(std::string& out, const std::string& text, const std::string& indent) {
  const std::size_t room = kPageWidth - indent.size();
  const auto fits = [&](std::string_view line) { return width(line) <= room; };
  for (const std::string& line : wrapped(printable(text), fits)) {
    out += indent + shortened(line, room) + "\n";
  }
}

/// Appends columns first to last - 1, preceded by the `n_front` columns of names.
void put_columns(std::string& out, const std::vector<std::vector<std::string>>& rows,
                 const std::vector<std::size_t>& widths, std::size_t first, std::size_t last,
                 std::size_t n_front, std::size_t n_names) {
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string line;
    std::size_t rule = 0;
    for (std::size_t c = 0; c < last; c = c + 1 == n_front ? first : c + 1) {
      line += "  ";
      line += c < n_names ? pad_right(rows[r][c], widths[c]) : pad_left(rows[r][c], widths[c]);
      rule += widths[c] + 2;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
    if (r == 0) out += "  " + repeated("─", rule - 2) + "\n";
  }
}

void put_text_table(std::string& out, const Table& table) {
  const bool text_only = table.n_names == table.header.size();  // its last column is not aligned
  std::vector<std::vector<std::string>> rows{table.header};
  rows.insert(rows.end(), table.rows.begin(), table.rows.end());
  std::vector<std::size_t> widths(table.header.size());
  for (auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      row[c] = shortened(printable(row[c]), text_only && c == 1 ? kValueColumns : kNameColumns);
      widths[c] = std::max(widths[c], width(row[c]));
    }
  }
  put_wrapped(out, table.caption, "");
  const std::size_t n_front = text_only ? 1 : table.n_names;
  std::size_t front = 0;
  for (std::size_t c = 0; c < n_front; ++c) front += 2 + widths[c];
  std::size_t first = n_front;
  while (first < widths.size()) {
    std::size_t last = first, used = front;
    while (last < widths.size() && (last == first || used + 2 + widths[last] <= kPageWidth)) {
      used += 2 + widths[last++];
    }
    if (first > n_front) out += "  (continued)\n";
    put_columns(out, rows, widths, first, last, n_front, table.n_names);
    first = last;
  }
  for (const std::string& note : table.notes) put_wrapped(out, note, "  ");
}

void put_log_ratio_ci95(Json& out, const std::optional<Interval>& interval) {
  put_interval(out, "log_ratio_ci95", interval);
  put_reduction_ci95(out, "percent_reduction", interval);
}

Json accuracy(const AccuracyCell& cell) {
  Json out;
  put_status(out, cell.n_trials == 0        ? "no trials"
                  : !cell.accuracy_answered ? "no trial was answered"
                                            : "");
  out["n_trials"] = cell.n_trials;
  out["n_correct"] = cell.n_correct;
  out["accuracy"] = number(cell.accuracy);
  out["accuracy_answered"] = number(cell.accuracy_answered);
  out["mean_of_participant_accuracies"] = number(cell.mean_of_participant_accuracies);
  return out;
}

Json counts(const Counts& counts) {
  return {{"n_participants", counts.n_participants}, {"n_trials", counts.n_trials},
          {"n_correct", counts.n_correct},           {"n_timeouts", counts.n_timeouts},
          {"n_too_fast", counts.n_too_fast},         {"n_used_for_times", counts.n_used_for_times},
          {"accuracy", number(counts.accuracy)}};
}

/// The evidence for no difference. \param name  of the 90 % interval
void put_evidence(Json& out, const std::string& name, const std::optional<double>& mean,
                  const TTest& test) {
  const PairedEvidence found = mean ? evidence_of(*mean, test) : PairedEvidence{};
  put_interval(out, name, found.ci90);
  out["least_bound"] = number(found.least_bound);
  out["bf10"] = number(found.bayes_factor);
}

Json paired(const PairedShape& shape, const TrialTable& table) {
  Json out;
  put_status(out, shape.undefined);
  out["n_pairs"] = shape.n_pairs;
  out["percent_reduction_arithmetic"] = number(shape.percent_reduction_arithmetic);
  out["mean_log_ratio"] = number(shape.mean_log_ratio);
  out["percent_reduction_geometric"] = number(shape.percent_reduction_geometric);

  Json& t = out["t_test"];
  put_status(t, shape.t_test.undefined);
  t["sd_log_ratio"] = number(shape.t_test.sd);
  t["se_log_ratio"] = number(shape.t_test.se);
  t["t"] = number(shape.t_test.t);
  t["df"] = number(shape.t_test.df);
  t["p"] = number(shape.t_test.p);
  put_log_ratio_ci95(t, shape.t_test.log_ratio_ci95);
  t["p_holm"] = number(shape.t_test.p_holm);
  put_evidence(t, "log_ratio_ci90", shape.mean_log_ratio, shape.t_test);

  Json& effect = out["effect_size"];
  put_status(effect, shape.effect_size.undefined);
  effect["dz"] = number(shape.effect_size.dz);
  effect["hedges_gz"] = number(shape.effect_size.hedges_gz);

  Json& ranks = out["wilcoxon"];
  put_status(ranks, shape.wilcoxon.undefined);
  ranks["V_positive_rank_sum"] = number(shape.wilcoxon.positive_rank_sum);
  ranks["n_nonzero"] = shape.wilcoxon.n_nonzero;
  ranks["p"] = number(shape.wilcoxon.p);
  ranks["method"] = shape.wilcoxon.exact ? "exact" : "normal approximation";

  Json& bootstrap = out["bootstrap"];
  put_status(bootstrap, shape.bootstrap.undefined);
  bootstrap["method"] = "BCa";
  bootstrap["resamples"] = shape.bootstrap.resamples;
  bootstrap["seed"] = shape.bootstrap.seed;
  bootstrap["bias_correction"] = number(shape.bootstrap.bias_correction);
  bootstrap["acceleration"] = number(shape.bootstrap.acceleration);
  put_log_ratio_ci95(bootstrap, shape.bootstrap.log_ratio_ci95);
  if (const auto coverage = bca_coverage(shape.n_pairs)) {
    bootstrap["coverage"] = *coverage;
    bootstrap["note"] =
        "Few pairs: `coverage` is that of the 95 % interval (simulated, normal differences; the t "
        "interval: 95 %).";
  }

  Json& dropped = out["dropped_participants"] = Json::array();
  for (const DroppedParticipant& one : shape.dropped) {
    dropped.push_back(
        {{"participant_id", table.participants[one.participant]}, {"no_time_with", one.renderers}});
  }
  return out;
}

Json paired_shapes(const Comparison& comparison, const TrialTable& table) {
  Json out;
  for (std::size_t s = 0; s < table.shapes.size(); ++s) {
    Json& one = out[table.shapes[s]] = paired(comparison.shapes[s], table);
    if (!comparison.censored.empty()) one["censored"] = censored_json(comparison.censored[s]);
  }
  return out;
}

Json accuracy_model_json(const AccuracyModel& model) {
  Json out{{"model", "logit = intercept + b r + shape + u + s r, r = -1/2, +1/2"},
           {"status", model.undefined.empty() ? "ok" : "undefined"}};
  if (!model.undefined.empty()) out["reason"] = model.undefined;
  out["n"] = model.participants;
  out["left_out"] = model.left_out;
  out["log_odds_ratio"] = number(model.log_odds_ratio);
  out["ci95_low"] = number(model.ci95_low);
  out["ci95_high"] = number(model.ci95_high);
  out["participant_sd"] = model.participant_sd;
  out["slope_sd"] = model.slope_sd;
  out["lr"] = number(model.likelihood_ratio);
  out["t"] = number(model.t);
  out["p"] = number(model.p);
  return out;
}

Json accuracy_difference_json(const AccuracyDifference& one,
                              const std::vector<std::string>& shapes) {
  const auto put = [](Json& out, const std::optional<double>& difference, const TTest& test) {
    out["status"] = test.undefined.empty() ? "ok" : "undefined";
    if (!test.undefined.empty()) out["reason"] = test.undefined;
    out["difference"] = number(difference);
    put_interval(out, "ci95", test.log_ratio_ci95);
    out["t"] = number(test.t);
    out["df"] = number(test.df);
    out["p"] = number(test.p);
    put_evidence(out, "ci90", difference, test);
  };
  Json out{{"n", one.n}};
  put(out, one.difference, one.test);
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    Json& shape = out["by_shape"][shapes[s]];
    put(shape, one.difference_by_shape[s], one.by_shape[s]);
    shape["p_holm"] = number(one.by_shape[s].p_holm);
  }
  out["model"] = accuracy_model_json(one.model);
  return out;
}

void put_accuracy_differences(Json& out, const AccuracyComparison& compared,
                              const std::vector<std::string>& shapes) {
  out["primary"] = accuracy_difference_json(compared.all, shapes);
  out["answered"] = accuracy_difference_json(compared.answered, shapes);
  out["depends_on_time_outs"] = compared.depends_on_time_outs;
}

/// paired_by_shape is the first comparison (ray with point if both are in the data); it names its
/// renderers unless they are ray and point. All further comparisons are in a list.
void put_comparisons(Json& out, const Analysis& analysis) {
  const TrialTable& table = analysis.table;
  const std::vector<Comparison>& all = analysis.comparisons;
  const auto of = [](const RendererPair& pair) {
    return Json{{"renderer", pair.renderer}, {"reference", pair.reference}};
  };
  if (!all.front().pair.is_ray_minus_point()) {
    out["paired_by_shape_of"] = all.front().pair.in_data() ? of(all.front().pair) : Json(nullptr);
  }
  out["paired_by_shape"] = paired_shapes(all.front(), table);
  for (std::size_t c = 1; c < all.size(); ++c) {
    Json one = of(all[c].pair);
    one["by_shape"] = paired_shapes(all[c], table);
    put_accuracy_differences(one["accuracy_comparison"], all[c].accuracy, table.shapes);
    one["speed_accuracy"] = speed_accuracy_json(all[c], table);
    put_pair_practice(one["practice"], analysis.practice.pairs[c], all[c].pair, table);
    out["further_comparisons"].push_back(std::move(one));
  }
}

Json provenance(const Provenance& from) {
  const auto text = [](const std::string& value) {
    return value.empty() ? Json(nullptr) : Json(value);
  };
  return {{"name", text(from.protocol_name)},
          {"sha256", from.protocol_sha256.size() == 1 ? Json(from.protocol_sha256.front())
                     : from.protocol_sha256.empty()   ? Json(nullptr)
                                                      : Json(from.protocol_sha256)}};
}

constexpr double kSignificanceLevel = 0.05;
constexpr std::size_t kMostCards = 12, kMostRowsOfCards = 4;

/// Outcome of the t-test at alpha 0.05: Holm-adjusted, and also unadjusted if the two differ.
std::string verdict(const TTest& test, std::size_t tests) {
  if (!test.p_holm) return "not testable";
  const std::string adjusted = (tests == 1 ? "" : "adjusted ") + p_phrase(*test.p_holm);
  if (*test.p_holm < kSignificanceLevel) return "clear, " + adjusted;
  if (*test.p >= kSignificanceLevel) return "no clear difference, " + adjusted;
  return "no clear difference among " + std::to_string(tests) + " tests, " + adjusted +
         " (by itself " + p_phrase(*test.p) + ")";
}

/// A log ratio of times as a percentage in the direction of a card.
class CardPercent {
 public:
  /// \param slower  the card says by how much slower: signs are turned, of ends too
  explicit CardPercent(bool slower) : slower_(slower) {}

  std::string value(double reduction) const { return fixed(slower_ ? -reduction : reduction, 1); }
  /// "3.1 to 12.0", the lower end first.
  std::string ends(const Interval& log_ratio) const {
    const Interval reduction = percent_reduction(log_ratio);
    return slower_ ? value(reduction.high) + " to " + value(reduction.low)
                   : value(reduction.low) + " to " + value(reduction.high);
  }
  const char* word() const { return slower_ ? "slower" : "faster"; }

 private:
  bool slower_;
};

/// Estimate and interval with time-outs as censored times.
void put_censored(std::string& out, const CensoredEstimate& censored, const CardPercent& shown) {
  out += "</small><small>with its " + counted(censored.n_censored, "time-out", "time-outs") +
         " as censored times: " + shown.value(percent_reduction(*censored.log_ratio)) + "\u00a0% ";
  out += shown.word();
  if (censored.log_ratio_ci95) out += " (" + shown.ends(*censored.log_ratio_ci95) + ")";
}

/// \param censored null: no time-outs \param tests number of tests that p is adjusted for
void put_card(std::string& out, const PairedShape& shape, const CensoredEstimate* censored,
              const std::string& name, const std::string& paper, std::size_t tests) {
  const auto& p = shape.t_test.p_holm;
  const bool clear = p && *p < kSignificanceLevel;
  const bool slower = shape.mean_log_ratio && *shape.mean_log_ratio > 0;
  const CardPercent shown(slower);
  out += "<li";
  if (clear) out += slower ? " class=\"slower\"" : " class=\"clear\"";
  out += "><b>" + escaped(printable(name, 80)) + "</b><span class=\"value\">";
  if (const auto& reduction = shape.percent_reduction_geometric) {
    out += shown.value(*reduction) + "\u00a0%</span> " + shown.word();
  } else {
    out += "–</span>";
  }
  out += "<small>";
  if (shape.t_test.log_ratio_ci95) {
    out += "95\u00a0% interval " + shown.ends(*shape.t_test.log_ratio_ci95) +
           "\u00a0%, not adjusted</small><small>";
  }
  out += escaped(verdict(shape.t_test, tests));
  if (censored && censored->n_censored > 0 && censored->log_ratio)
    put_censored(out, *censored, shown);
  if (!paper.empty()) {
    out += "</small><small>paper: " + escaped_sentence(paper);
    if (paper.ends_with('%')) out += " faster";
  }
  out += "</small></li>\n";
}

constexpr std::size_t kMostProtocol = 200'000;  // bytes

/// Heading of a section: anchor, title and text in the navigation.
struct Heading {
  std::string id, title, link;
};

class Report {
 public:
  Report(const Analysis& analysis, const StudyRecord& record)
      : analysis_(analysis),
        record_(record),
        label_(simulated_label(analysis.table.simulated)),
        figures_(figures_of(analysis, record)),
        page_(conclusion(analysis), label_) {}

  std::string html() {
    if (!label_.empty()) {
      page_.put_banner(
          label_ + (analysis_.table.simulated == Simulated::yes
                        ? ": all numbers here are from a model of a participant, not from humans."
                        : ": the numbers here mix simulated participants with humans."));
    }
    put_header();
    put_sections();
    return page_.html("palpate " + analysis_.program_version + ".");
  }

 private:
  void put_header() {
    const std::string study = study_name();
    if (!study.empty()) {
      page_.above_title() += "<p class=\"study\">" + escaped(printable(study, 400)) + "</p>\n";
    }
    std::string& out = page_.below_title();
    const Counts& counts = analysis_.description.counts;
    out += "<p class=\"lead\">" + counted(counts.n_participants, "participant", "participants") +
           ", " + counted(counts.n_trials, "trial", "trials") + ", " +
           fixed(100 * counts.accuracy.value_or(0), 1) + "\u00a0% correct; " +
           counted(counts.n_used_for_times, "time", "times") + " used.</p>\n";
    put_reduction_cards(out, analysis_);
    put_warnings(out);
  }

  void put_warnings(std::string& out) const {
    if (analysis_.warnings.empty()) return;
    out += "<ul class=\"warnings\" aria-label=\"Warnings\">\n";
    constexpr std::size_t kMost = 100;
    const std::size_t n = std::min(analysis_.warnings.size(), kMost);
    for (std::size_t i = 0; i < n; ++i) {
      out += "<li>" + escaped_sentence(printable(analysis_.warnings[i], 4000)) + "</li>\n";
    }
    if (n < analysis_.warnings.size()) {
      out += "<li>and " + std::to_string(analysis_.warnings.size() - n) + " more</li>\n";
    }
    out += "</ul>\n";
  }

  /// The protocol's title if it has one, else its name.
  std::string study_name() const {
    for (const ProtocolText& protocol : record_.protocols) {
      if (!protocol.title.empty()) return protocol.title;
    }
    return analysis_.table.provenance.protocol_name;
  }

  const Figure* figure(std::string_view id) const {
    const auto found = std::ranges::find(figures_, id, &Figure::id);
    return found == figures_.end() ? nullptr : &*found;
  }

  /// \return false if there is no such figure for these data
  bool put_figure(std::string_view id) {
    const Figure* drawn = figure(id);
    if (drawn)
      page_.put_figure(*drawn, id == "figure15" ? participants() : std::vector<std::string>());
    return drawn != nullptr;
  }

  /// Participants who can be highlighted: those drawn one by one.
  std::vector<std::string> participants() const {
    std::vector<std::string> names;
    for (const std::string& name : analysis_.table.participants) {
      if (names.size() == kShownParticipants) break;
      names.push_back(printable(name, 40));
    }
    return names;
  }

  /// A section with a figure and tables of its numbers. \param missing sentence in place of a
  /// missing figure
  void figure_section(const Heading& heading, const std::vector<Table>& tables,
                      std::string_view missing) {
    begin(heading);
    if (!put_figure(heading.id)) page_.put_note(missing);
    if (!tables.empty()) put_collapsible_tables(page_.body(), "Table of the numbers", tables);
    page_.end_section();
  }

  void begin(const Heading& heading) {
    page_.begin_section(heading.id, heading.title, heading.link);
  }

  void put_sections() {
    const bool both = analysis_.table.renderers.size() > 1;
    const bool paper = compares_as_paper(analysis_);
    figure_section({"figure15", paper ? "Mean response times (figure 15)" : "Mean response times",
                    paper ? "Figure 15" : "Mean times"},
                   {times_table(analysis_)}, "No times to show.");
    begin({"speedup",
           "Reduction of response time " + with_renderer(analysis_, "against") +
               (paper ? ", and in the paper" : ""),
           "Speed-up"});
    if (!put_figure("speedup")) {
      page_.put_note(
          "No participant has times with both renderers, so there is nothing to compare.");
    }
    put_table(page_.body(), reduction_table(analysis_));
    put_quotable(page_.body(), sentences_to_quote(analysis_));
    const Table censored = censored_table(analysis_);
    if (!censored.rows.empty()) put_table(page_.body(), censored);
    page_.end_section();
    if (figure("times")) {
      figure_section({"times", "Distributions of the times", "Times"}, {}, "");
    }
    std::vector<Table> answers = confusion_tables(analysis_);
    answers.push_back(accuracy_table(analysis_));
    if (analysis_.table.renderers.size() > 1)
      answers.push_back(accuracy_difference_table(analysis_));
    figure_section({"confusion", "Shapes shown and answered", "Confusion"}, answers, "");
    if (both) {
      figure_section({"speed-accuracy", "Speed-accuracy trade-off", "Speed and accuracy"},
                     {speed_accuracy_table(analysis_)},
                     "Time and accuracy cannot be compared: no participant has both renderers.");
    }
    figure_section({"learning", "Practice: learning over the trials", "Learning"},
                   {learning_table(analysis_)}, "Not enough trials for a learning curve.");
    if (both) {
      figure_section({"order", "Practice: order of the renderers", "Order"},
                     {renderer_order_table(analysis_)},
                     "The two orders of the renderers cannot be compared in these data.");
    }
    figure_section({"servo", "Timing of the servo loop", "Servo"}, servo_tables(),
                   servo_sentence(analysis_, record_));
    std::vector<Table> lost{exclusions_table(analysis_)};
    if (analysis_.time_outs.any) lost.push_back(time_outs_table(analysis_));
    figure_section({"exclusions", "Trials excluded from the times", "Exclusions"}, lost, "");
    begin({"tests", "The tests", "Tests"});
    for (const Table& table : {tests_table(analysis_), anova_table(analysis_),
                               mixed_model_table(analysis_), shape_slope_table(analysis_)}) {
      put_table(page_.body(), table);
    }
    page_.end_section();
    put_registration_section(page_, record_.checked, record_.check_page);
    begin({"source", "Protocol, seeds, versions and checksums", "Source"});
    put_source();
    page_.end_section();
  }

  std::vector<Table> servo_tables() const {
    if (record_.servo.empty()) return {};
    Table table;
    table.caption = "Servo, by renderer" + (label_.empty() ? "" : " (" + label_ + ")");
    table.header = {
        "renderer",           "trials",         "ticks",      "missed",         "of ticks",
        "trials with missed", "longest period", "with fault", "started inside", "largest force"};
    for (const ServoQuality& servo : record_.servo) {
      const double percent_missed = servo.ticks
                                        ? 100 * static_cast<double>(servo.missed_ticks) /
                                              static_cast<double>(servo.ticks + servo.missed_ticks)
                                        : 0;
      table.rows.push_back(
          {servo.renderer, std::to_string(servo.n_trials), std::to_string(servo.ticks),
           std::to_string(servo.missed_ticks), fixed(percent_missed, 4) + " %",
           std::to_string(servo.n_with_missed), fixed(1000 * servo.longest_period, 3) + " ms",
           std::to_string(servo.n_with_faults), std::to_string(servo.n_started_inside),
           fixed(servo.max_force, 2) + " N"});
    }
    table.notes = {"Missed: whole periods that passed without a tick. " +
                   counted(record_.n_cut_off, "attempt was", "attempts were") +
                   " interrupted and repeated."};
    return {table};
  }

  void put_source() {
    Table table = provenance_table(analysis_);
    const auto add = [&](const char* what, const std::vector<std::string>& values) {
      for (const std::string& value : values) table.rows.push_back({what, value});
    };
    add("device", record_.devices);
    add("response device", record_.response_devices);
    add("recorded with build", record_.builds);
    for (const ProtocolText& protocol : record_.protocols) {
      if (!protocol.seed.empty()) table.rows.push_back({"protocol seed", protocol.seed});
    }
    table.rows.push_back({"bootstrap seed", std::to_string(analysis_.settings.seed)});
    put_table(page_.body(), table);
    if (!record_.protocols.empty()) {
      page_.put_note(
          "If servo samples were kept, a trial can be played back: palpate watch "
          "--db FILE --trial CODE/SESSION/TRIAL --out PAGE.html");
    }
    if (!record_.seeds.empty()) {
      constexpr std::size_t kMost = 500;
      const std::size_t n = std::min(record_.seeds.size(), kMost);
      page_.body() +=
          "<details>\n<summary>Seeds of the simulated participants</summary>\n<p "
          "class=\"note\">" +
          escaped(joined(std::vector<std::string>(
              record_.seeds.begin(), record_.seeds.begin() + static_cast<std::ptrdiff_t>(n)))) +
          (n < record_.seeds.size() ? " …" : "") + "</p>\n</details>\n";
    }
    for (const ProtocolText& protocol : record_.protocols) {
      page_.body() += "<details class=\"long\">\n<summary>Protocol “" +
                      escaped(printable(protocol.name, 200)) +
                      "” as it was used</summary>\n<pre tabindex=\"0\">" +
                      protocol_lines(protocol.text) + "</pre>\n</details>\n";
    }
  }

  static std::string protocol_lines(std::string_view text) {
    const bool cut = text.size() > kMostProtocol;
    if (cut) text = text.substr(0, kMostProtocol);
    const std::string out = escaped_lines(text);
    return cut ? out + "…" : out;
  }

  const Analysis& analysis_;
  const StudyRecord& record_;
  std::string label_;
  std::vector<Figure> figures_;
  HtmlPage page_;
};

}  // namespace

std::string table_text(const Table& table) {
  std::string out;
  put_text_table(out, table);
  return out;
}

std::string paragraph_text(const std::string& text) {
  std::string out;
  put_wrapped(out, text, "");
  return out;
}

std::string report_text(const Analysis& analysis) {
  std::string out;
  const std::string label = simulated_label(analysis.table.simulated);
  if (!label.empty()) {
    out += repeated("═", kPageWidth) + "\n";
    put_wrapped(
        out,
        label + (analysis.table.simulated == Simulated::yes
                     ? ": all numbers below are from a model of a participant, not from humans."
                     : ": the numbers below mix simulated participants with humans."),
        "  ");
    out += repeated("═", kPageWidth) + "\n\n";
  }
  put_wrapped(out, conclusion(analysis), "");
  const Counts& counts = analysis.description.counts;
  put_wrapped(out,
              counted(counts.n_participants, "participant", "participants") + ", " +
                  counted(counts.n_trials, "trial", "trials") + ", " +
                  fixed(100 * counts.accuracy.value_or(0), 1) + " % correct; " +
                  counted(counts.n_used_for_times, "time", "times") + " used.",
              "");
  for (const std::string& warning : analysis.warnings) {
    put_wrapped(out, "Warning: " + warning, "");
  }
  for (const Table& table : all_tables(analysis)) {
    out += "\n";
    put_text_table(out, table);
  }
  const std::vector<std::string> sentences = sentences_to_quote(analysis);
  if (!sentences.empty()) out += "\nTo quote\n";
  for (const std::string& sentence : sentences) put_wrapped(out, sentence, "  ");
  return out;
}

std::string report_json(const Analysis& analysis) {
  const TrialTable& table = analysis.table;
  const Description& description = analysis.description;
  Json out;
  out["version"] = 1;
  out["simulated"] =
      table.simulated == Simulated::mixed ? Json("mixed") : Json(table.simulated == Simulated::yes);
  out["source"] = table.provenance.source;
  out["program_version"] = analysis.program_version;
  out["protocol"] = provenance(table.provenance);
  out["observer_sha256"] = table.provenance.observer_sha256.empty()
                               ? Json(nullptr)
                               : Json(table.provenance.observer_sha256);
  out["recorded_with"] = table.provenance.program_versions;
  out["settings"] = {{"too_fast_s", analysis.settings.too_fast}};
  out["warnings"] = analysis.warnings;
  out["counts"] = counts(description.counts);
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    const std::string& renderer = table.renderers[r];
    for (std::size_t s = 0; s < table.shapes.size(); ++s) {
      const std::string& shape = table.shapes[s];
      out["accuracy"][renderer][shape] = accuracy(description.accuracy[r][s]);
      Json& row = out["confusion"][renderer][shape];
      for (std::size_t a = 0; a < table.answers.size(); ++a) {
        row[table.answers[a]] = description.confusion[r][s][a];
      }
      row["no_response"] = description.confusion[r][s].back();
      out["times"][renderer][shape] = times(description.times[r][s]);
    }
  }
  put_accuracy_differences(out["accuracy_comparison"], analysis.comparisons.front().accuracy,
                           table.shapes);
  if (analysis.time_outs.any) out["time_outs"] = time_outs_json(analysis);
  put_comparisons(out, analysis);
  out["rm_anova"] = anova_json(analysis.rm_anova, table);
  out["mixed_model"] = mixed_model_json(analysis);
  out["mixed_model_by_shape"] = shape_slope_json(analysis);
  out["speed_accuracy"] = speed_accuracy_json(analysis.comparisons.front(), table);
  out["practice"] = practice_json(analysis);
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    const Exclusions& lost = analysis.exclusions[r];
    out["exclusions"][table.renderers[r]] = {{"n_trials", lost.n_trials},
                                             {"n_timeouts", lost.n_timeouts},
                                             {"n_wrong", lost.n_wrong},
                                             {"n_correct_too_fast", lost.n_too_fast},
                                             {"n_used_for_times", lost.n_used}};
  }
  // Replace invalid UTF-8 from a file, so that the JSON is valid.
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void put_reduction_cards(std::string& out, const Analysis& analysis) {
  const std::vector<Comparison>& all = analysis.comparisons;
  const std::size_t rows = std::min(all.size(), kMostRowsOfCards);
  const std::size_t n = std::min(analysis.table.shapes.size(), kMostCards);
  const std::size_t tests = number_of_tests(all);
  for (std::size_t c = 0; c < rows; ++c) {
    std::string compared = with_renderer(analysis, "against");
    if (all.size() > 1) {
      compared = "with " + with_article(printable(all[c].pair.renderer, 80)) + " " + compared;
      out += "<p class=\"study\">" + escaped(compared) + "</p>\n";
    }
    out += "<ul class=\"cards\" aria-label=\"Reduction of the time " + escaped(compared) +
           ", by shape\">\n";
    for (std::size_t s = 0; s < n; ++s) {
      const std::string& name = analysis.table.shapes[s];
      put_card(out, all[c].shapes[s], all[c].censored.empty() ? nullptr : &all[c].censored[s], name,
               paper_reduction(all[c].pair, name), tests);
    }
    out += "</ul>\n";
  }
  if (n < analysis.table.shapes.size()) {
    out += "<p class=\"note\">The first " + std::to_string(n) + " of " +
           std::to_string(analysis.table.shapes.size()) + " shapes.</p>\n";
  }
  if (rows < all.size()) {
    out += "<p class=\"note\">The first " + std::to_string(rows) + " of " +
           std::to_string(all.size()) + " comparisons.</p>\n";
  }
}

std::string report_html(const Analysis& analysis, const StudyRecord& record) {
  return Report(analysis, record).html();
}

}  // namespace palpate::analysis
