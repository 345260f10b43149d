#include "analysis/report/report_html.h"

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/figures_svg.h"
#include "analysis/figures/figures_vega.h"
#include "analysis/report/report_assets.h"
#include "analysis/report/report_cards.h"
#include "analysis/report/report_page.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/wording.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kMostProtocol = 200'000;  // bytes

/// Colours of the roles that the page's style does not know.
std::string further_colours(std::size_t roles) {
  if (roles == kUsualRoles) return {};
  const auto values = [&](const Palette& palette) {
    std::string out = ":root {";
    for (std::size_t r = kUsualRoles; r < roles; ++r) {
      out += " --";
      out += to_string(static_cast<Role>(r));
      out += ": " + palette[r] + ";";
    }
    return out + " }\n";
  };
  return values(light_palette()) + "@media screen and (prefers-color-scheme: dark) {\n" +
         values(dark_palette()) + "}\n";
}

/// A section of the page: what it is called there and in the line of links.
struct Heading {
  std::string id, title, link;
};

class Page {
 public:
  Page(const Analysis& analysis, const ReportRecord& record)
      : analysis_(analysis),
        record_(record),
        label_(simulated_label(analysis.table.simulated)),
        figures_(figures_of(analysis, record)) {}

  std::string html() {
    sections();
    const std::string vega = vega_script(), script(report_script());
    std::string out = head(vega, script);
    if (!label_.empty()) {
      out += "<div class=\"flag\" role=\"note\">" + label_ +
             (analysis_.table.simulated == Simulated::yes
                  ? ": every figure here comes from a model of a person, not from people."
                  : ": the figures here mix a model of a person with people.") +
             "</div>\n";
    }
    put_header(out);
    out += "<nav aria-label=\"Parts of the report\"><ul>\n";
    for (const Heading& heading : headings_) {
      out += "<li><a href=\"#" + heading.id + "\">" + escaped(heading.link) + "</a></li>\n";
    }
    out += "</ul></nav>\n<main id=\"content\">\n" + body_ + "</main>\n<footer><p>palpate " +
           escaped(analysis_.program_version) +
           ". This page is complete in itself and asks the network for nothing.</p></footer>\n";
    out += "<script type=\"application/json\" id=\"report-data\">" + data() + "</script>\n";
    if (!vega.empty()) out += "<script>" + vega + "</script>\n";
    return out + "<script>" + script + "</script>\n</body>\n</html>\n";
  }

 private:
  std::string head(const std::string& vega, const std::string& script) const {
    const std::string answered = escaped_sentence(answer(analysis_));
    std::string hashes = "'" + script_hash(script) + "'";
    if (!vega.empty()) hashes += " '" + script_hash(vega) + "'";
    std::string out =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src ";
    out += hashes;
    out +=
        "; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\"/>\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>";
    if (!label_.empty()) out += label_ + ": ";
    out += answered + "</title>\n<link rel=\"icon\" href=\"data:,\"/>\n<style>";
    out += report_style();
    out += further_colours(roles());
    return out +
           "</style>\n</head>\n<body>\n<a class=\"skip\" href=\"#content\">To the content</a>\n";
  }

  void put_header(std::string& out) const {
    out += "<header>\n";
    const std::string study = study_name();
    if (!study.empty())
      out += "<p class=\"study\">" + escaped(stimuli::printable(study, 400)) + "</p>\n";
    const Counts& counts = analysis_.description.counts;
    out += "<h1>" + escaped_sentence(answer(analysis_)) + "</h1>\n<p class=\"lead\">" +
           counted(counts.n_participants, "participant", "participants") + ", " +
           counted(counts.n_trials, "trial", "trials") + ", " +
           fixed(100 * counts.accuracy.value_or(0), 1) + "\u00a0% correct; " +
           counted(counts.n_used_for_times, "time", "times") + " used.</p>\n";
    put_cards(out, analysis_);
    if (!analysis_.warnings.empty()) {
      out += "<ul class=\"warnings\" aria-label=\"Warnings\">\n";
      constexpr std::size_t kMost = 100;
      const std::size_t n = std::min(analysis_.warnings.size(), kMost);
      for (std::size_t i = 0; i < n; ++i) {
        out +=
            "<li>" + escaped_sentence(stimuli::printable(analysis_.warnings[i], 4000)) + "</li>\n";
      }
      if (n < analysis_.warnings.size()) {
        out += "<li>and " + std::to_string(analysis_.warnings.size() - n) + " more</li>\n";
      }
      out += "</ul>\n";
    }
    out += "</header>\n";
  }

  /// The protocol's title where it has one, else its name.
  std::string study_name() const {
    for (const ProtocolText& protocol : record_.protocols) {
      if (!protocol.title.empty()) return protocol.title;
    }
    return analysis_.table.provenance.protocol_name;
  }

  void begin(Heading heading) {
    body_ += "<section id=\"" + heading.id + "\" aria-labelledby=\"" + heading.id +
             "-heading\">\n<h2 id=\"" + heading.id + "-heading\">" + escaped(heading.title) +
             "</h2>\n";
    headings_.push_back(std::move(heading));
  }
  void end() { body_ += "</section>\n"; }

  const Figure* figure(std::string_view id) const {
    const auto found = std::ranges::find(figures_, id, &Figure::id);
    return found == figures_.end() ? nullptr : &*found;
  }

  /// \return false where the data have no such figure
  bool put_figure(std::string_view id) {
    const Figure* drawn = figure(id);
    if (!drawn) return false;
    body_ += "<figure>\n<div class=\"drawing\">\n<div class=\"fixed\">" +
             figure_svg(*drawn, page_palette(), Stands::in_page) + "</div>\n</div>\n<figcaption>";
    for (const std::string& note : drawn->notes) body_ += escaped_sentence(note) + " ";
    body_ += "</figcaption>\n</figure>\n<div class=\"tools\">\n";
    for (const char* kind : {"svg", "png"}) {
      const std::string name = kind == std::string_view("svg") ? "SVG" : "PNG";
      body_ += std::string("<button type=\"button\" data-save=\"") + kind +
               "\" hidden=\"hidden\" aria-label=\"Save the figure “" + escaped(drawn->title) +
               "” as " + name + "\">Save as " + name + "</button>\n";
    }
    if (id == "figure15") put_chooser();
    body_ += "</div>\n";
    return true;
  }

  void put_chooser() {
    body_ +=
        "<label hidden=\"hidden\">Highlight a participant <select id=\"person\"><option "
        "value=\"\">nobody</option>";
    const auto& people = analysis_.table.participants;
    const std::size_t n = std::min(people.size(), kShownPeople);
    for (std::size_t p = 0; p < n; ++p) {
      const std::string code = escaped(stimuli::printable(people[p], 40));
      body_ += "<option value=\"" + code + "\">" + code + "</option>";
    }
    body_ += "</select></label>\n";
  }

  void put_missing(std::string_view why) {
    body_ += "<p class=\"note\">" + escaped(why) + "</p>\n";
  }

  /// A section with a figure and its numbers as tables.
  void figure_section(Heading heading, const std::vector<Table>& tables, std::string_view missing) {
    const std::string id = heading.id;
    begin(std::move(heading));
    if (!put_figure(id)) put_missing(missing);
    if (!tables.empty()) put_folded(body_, "The numbers as a table", tables);
    end();
  }

  void sections() {
    const bool both = analysis_.table.renderers.size() > 1;
    const bool paper = compares_as_paper(analysis_);
    figure_section({"figure15", paper ? "How long people took (figure 15)" : "How long people took",
                    paper ? "Figure 15" : "Mean times"},
                   {times_table(analysis_)}, "No times to show.");
    begin({"speedup",
           "How much faster " + with_renderer(analysis_, "than with") +
               (paper ? ", beside the paper" : ""),
           "Speed-up"});
    if (!put_figure("speedup")) {
      put_missing("No participant has times with both renderers, so there is nothing to compare.");
    }
    put_table(body_, reduction_table(analysis_));
    const Table censored = censored_table(analysis_);
    if (!censored.rows.empty()) put_table(body_, censored);
    end();
    if (figure("times")) {
      figure_section({"times", "Distributions of the times", "Times"}, {}, "");
    }
    std::vector<Table> answers = confusion_tables(analysis_);
    answers.push_back(accuracy_table(analysis_));
    figure_section({"confusion", "What was taken for what", "Confusion"}, answers, "");
    if (both) {
      figure_section({"speed-accuracy", "Was speed bought with errors?", "Speed and accuracy"},
                     {speed_accuracy_table(analysis_)},
                     "Time and accuracy cannot be compared: no participant has both renderers.");
    }
    figure_section({"learning", "Does practice explain it? Learning over the trials", "Learning"},
                   {learning_table(analysis_)}, "Not enough trials for a learning curve.");
    if (both) {
      figure_section({"order", "Does practice explain it? Which renderer came first", "Order"},
                     {renderer_order_table(analysis_)},
                     "The two orders of the renderers cannot be compared in these data.");
    }
    figure_section({"servo", "How well the servo kept time", "Servo"}, servo_tables(),
                   servo_sentence(analysis_, record_));
    std::vector<Table> lost{exclusions_table(analysis_)};
    if (analysis_.time_outs.any) lost.push_back(time_outs_table(analysis_));
    figure_section({"exclusions", "What was left out", "Exclusions"}, lost, "");
    begin({"tests", "The tests", "Tests"});
    for (const Table& table :
         {tests_table(analysis_), anova_table(analysis_), mixed_model_table(analysis_)}) {
      put_table(body_, table);
    }
    end();
    begin({"source", "Protocol, seeds, versions and checksums", "Source"});
    put_source();
    end();
  }

  std::vector<Table> servo_tables() const {
    if (record_.servo.empty()) return {};
    Table table;
    table.caption = "Servo, by renderer" + (label_.empty() ? "" : " (" + label_ + ")");
    table.header = {
        "renderer",           "trials",         "ticks",      "missed",       "of ticks",
        "trials with missed", "longest period", "with fault", "began inside", "largest force"};
    for (const ServoQuality& servo : record_.servo) {
      const double share = servo.ticks ? 100 * static_cast<double>(servo.missed_ticks) /
                                             static_cast<double>(servo.ticks + servo.missed_ticks)
                                       : 0;
      table.rows.push_back(
          {servo.renderer, std::to_string(servo.n_trials), std::to_string(servo.ticks),
           std::to_string(servo.missed_ticks), fixed(share, 4) + " %",
           std::to_string(servo.n_with_missed), fixed(1000 * servo.longest_period, 3) + " ms",
           std::to_string(servo.n_with_faults), std::to_string(servo.n_started_inside),
           fixed(servo.max_force, 2) + " N"});
    }
    table.notes = {"Missed: whole periods that passed without a tick. " +
                   counted(record_.n_cut_off, "attempt was", "attempts were") +
                   " cut off and shown again."};
    return {table};
  }

  void put_source() {
    Table table = provenance_table(analysis_);
    const auto add = [&](const char* what, const std::vector<std::string>& values) {
      for (const std::string& value : values) table.rows.push_back({what, value});
    };
    add("device", record_.devices);
    add("answers from", record_.response_devices);
    add("recorded with build", record_.builds);
    for (const ProtocolText& protocol : record_.protocols) {
      if (!protocol.seed.empty()) table.rows.push_back({"protocol seed", protocol.seed});
    }
    table.rows.push_back({"bootstrap seed", std::to_string(analysis_.settings.seed)});
    put_table(body_, table);
    if (!record_.seeds.empty()) {
      constexpr std::size_t kMost = 500;
      const std::size_t n = std::min(record_.seeds.size(), kMost);
      body_ +=
          "<details>\n<summary>Seeds of the simulated participants</summary>\n<p "
          "class=\"note\">" +
          escaped(joined(std::vector<std::string>(
              record_.seeds.begin(), record_.seeds.begin() + static_cast<std::ptrdiff_t>(n)))) +
          (n < record_.seeds.size() ? " …" : "") + "</p>\n</details>\n";
    }
    for (const ProtocolText& protocol : record_.protocols) {
      body_ += "<details class=\"long\">\n<summary>Protocol “" +
               escaped(stimuli::printable(protocol.name, 200)) +
               "” as it was used</summary>\n<pre tabindex=\"0\">" + protocol_lines(protocol.text) +
               "</pre>\n</details>\n";
    }
  }

  /// Escaped line by line: line ends stay.
  static std::string protocol_lines(std::string_view text) {
    std::string out;
    const bool cut = text.size() > kMostProtocol;
    if (cut) text = text.substr(0, kMostProtocol);
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      if (line.ends_with('\r')) line.remove_suffix(1);
      std::string plain(line);
      std::ranges::replace(plain, '\t', ' ');
      out += escaped(plain);
      out += '\n';
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    return cut ? out + "…" : out;
  }

  /// That the figures have colours of.
  std::size_t roles() const {
    std::size_t most = kUsualRoles;
    for (const Figure& drawn : figures_) most = std::max(most, roles_in(drawn));
    return most;
  }

  std::string data() const {
    nlohmann::ordered_json json;
    const Palette light = light_palette();
    for (std::size_t r = 0; r < roles(); ++r) {
      json["palette"][to_string(static_cast<Role>(r))] = light[r];
    }
    json["figures"] = nlohmann::ordered_json::object();
    for (const Figure& drawn : figures_) json["figures"][drawn.id] = vega_spec(drawn);
    return inside_script(
        json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  }

  const Analysis& analysis_;
  const ReportRecord& record_;
  std::string label_;
  std::vector<Figure> figures_;
  std::vector<Heading> headings_;
  std::string body_;
};

}  // namespace

std::string report_html(const Analysis& analysis, const ReportRecord& record) {
  return Page(analysis, record).html();
}

}  // namespace palpate::analysis
