#include "runner/touch/trial_page.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/report/html_page.h"
#include "analysis/text.h"
#include "data/base/base64.h"
#include "data/base/text.h"
#include "rendering/renderer.h"
#include "runner/display/scene/drawn_mesh.h"
#include "runner/display/seen.h"
#include "runner/safety/fault_signals.h"
#include "runner/scene_builder.h"
#include "runner/session/recorded_trial.h"
#include "runner/session/replay.h"
#include "stimuli/texture.h"

namespace palpate::runner::touch {
namespace {

// Columns of numbers in the text of a page: integer multiples of a step, as differences of the
// order that takes the fewest bytes, 7 bits a byte (zigzag, least significant first), in one zlib
// stream (RFC 1950) in base64. trial.js reads them.

class WholeNumbers {
 public:
  /// Values are rounded to the step; one that is not finite repeats the previous one.
  /// \param steps_per_unit  1e8: to 10 nm
  void add(const std::string& name, std::span<const double> values, double steps_per_unit);

  /// [[name, count, steps per unit, order], ...]
  const nlohmann::ordered_json& columns() const { return columns_; }
  /// All columns, one after the other.
  std::string text() const;

 private:
  nlohmann::ordered_json columns_ = nlohmann::ordered_json::array();
  std::string bytes_;
};

constexpr int kHighestOrder = 3;
// JavaScript has double precision, exact to 2^53; a difference of order 3 is up to 8 times a value,
// and zigzag doubles it.
constexpr double kLargest = 1e14;

void put(std::string& out, std::int64_t value) {
  std::uint64_t rest =
      (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);  // zigzag
  for (; rest > 127; rest >>= 7) out += static_cast<char>((rest & 127) | 128);
  out += static_cast<char>(rest);
}

std::string packed(const std::vector<std::int64_t>& values) {
  std::string out;
  for (const std::int64_t value : values) put(out, value);
  return out;
}

/// Differences in place; the value before the first counts as 0.
void difference(std::vector<std::int64_t>& values) {
  for (std::size_t i = values.size(); i-- > 1;) values[i] -= values[i - 1];
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()),
                Z_BEST_COMPRESSION) != Z_OK)
    throw std::runtime_error("the ticks could not be compressed");
  out.resize(size);
  return out;
}

void WholeNumbers::add(const std::string& name, std::span<const double> values,
                       double steps_per_unit) {
  std::vector<std::int64_t> whole;
  whole.reserve(values.size());
  for (const double value : values) {
    const double steps = value * steps_per_unit;
    const std::int64_t before = whole.empty() ? 0 : whole.back();
    whole.push_back(std::isfinite(steps) ? std::llround(std::clamp(steps, -kLargest, kLargest))
                                         : before);
  }
  int best_order = 0;
  std::string best = packed(whole);
  for (int order = 1; order <= kHighestOrder; ++order) {
    difference(whole);
    std::string bytes = packed(whole);
    if (bytes.size() >= best.size()) continue;
    best = std::move(bytes);
    best_order = order;
  }
  columns_.push_back({name, values.size(), steps_per_unit, best_order});
  bytes_ += best;
}

std::string WholeNumbers::text() const { return base64_encoded(deflated(bytes_)); }

using Cell = std::array<std::int64_t, 3>;

/// Merges the corners in each cell of a grid into their mean, and removes collapsed triangles.
PictureMesh clustered(const display::DrawnMesh& drawn, double cell) {
  PictureMesh out;
  std::map<Cell, std::uint32_t> known;
  std::vector<double> counts;
  std::set<std::array<std::uint32_t, 3>> seen;
  for (std::size_t i = 0; i + 2 < drawn.size(); i += 3) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p(drawn[i + k].position);
      const Cell at{std::llround(p.x / cell), std::llround(p.y / cell), std::llround(p.z / cell)};
      const auto [found, is_new] =
          known.try_emplace(at, static_cast<std::uint32_t>(out.corners.size()));
      if (is_new) {
        out.corners.emplace_back(0);
        counts.push_back(0);
      }
      triangle[k] = found->second;
      out.corners[triangle[k]] += p;
      ++counts[triangle[k]];
    }
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0])
      continue;
    // Start at the lowest corner and keep the orientation, so that equal triangles are found.
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
    if (seen.insert(triangle).second) out.triangles.push_back(triangle);
  }
  for (std::size_t i = 0; i < out.corners.size(); ++i) out.corners[i] /= counts[i];
  return out;
}

double size_of(const display::DrawnMesh& drawn) {
  Vec3 low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
  for (const display::DrawnVertex& corner : drawn) {
    low = glm::min(low, Vec3(corner.position));
    high = glm::max(high, Vec3(corner.position));
  }
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

using analysis::counted;
using analysis::escaped;
using analysis::fixed;
using Json = nlohmann::ordered_json;

// Resolution of the page: finer than devices sense or render.
constexpr double kPerSecond = 1e6, kPerMetre = 1e8, kPerNewton = 1e5, kPerUnit = 1e7;
constexpr std::size_t kMostTriangles = 6000;  // of all objects of a page

/// The ticks of a trial by one renderer, as columns.
struct ShownTicks {
  std::map<std::string, std::vector<double>> columns;
  std::vector<std::size_t> intervals;  ///< ticks of each interval
  std::size_t equal = 0;               ///< ticks equal to the record, bit by bit
  std::size_t count = 0;

  void put(const std::string& name, double value) { columns[name].push_back(value); }
  void put(const std::string& name, const Vec3& v) {
    put(name + "_x", v.x);
    put(name + "_y", v.y);
    put(name + "_z", v.z);
  }
};

Vec3 vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

void put_body(ShownTicks& out, const std::optional<rendering::BodyPose>& body) {
  const Pose moved = body ? body->moved : Pose();
  out.put("moved", moved.position);
  const Quat& q = moved.orientation;
  for (const auto& [name, value] :
       {std::pair{"w", q.w}, std::pair{"x", q.x}, std::pair{"y", q.y}, std::pair{"z", q.z}})
    out.put(std::string("moved_q") + name, value);
}

/// \param other  render the path with the other renderer
ShownTicks ticks_of(const session::RecordedTrial& trial, bool other) {
  ShownTicks out;
  const data::TrialRecord& record = trial.stored.record;
  const bool moves = std::ranges::any_of(trial.protocol.stimuli, [](const auto& stimulus) {
    return stimulus.object.body.has_value();
  });
  const bool tool = !trial.protocol.tool.segments.empty();
  double time = 0;
  session::replay(
      trial.protocol, record, other,
      [&](std::size_t interval, const data::SampleRecord& was, const session::ReplayedSample& is) {
        if (interval == out.intervals.size()) {
          out.intervals.push_back(0);
          time = 0;
        } else {
          time += static_cast<double>(is.period_ns) * 1e-9;
        }
        ++out.intervals.back();
        ++out.count;
        const rendering::Rendering& r = is.rendering;
        const Vec3 tip = vec(was.tip), tail = vec(was.tail);
        if (!other) {
          out.equal += session::equals_record(record, was, is);
          out.put("t", time);
          out.put("tip", tip);
          out.put("tail", tail);
        }
        out.put("force", other ? r.force : vec(was.force));
        out.put("depth", other ? r.deepest.depth : was.depth);
        const int contacts = other ? servo::recorded_contacts(r.contacts) : was.contacts;
        out.put("contacts", contacts);
        out.put("type", other ? static_cast<double>(r.deepest.type) : was.contact_type);
        out.put("faults", other ? r.faults : was.faults);
        out.put("lag_tip", r.ideal.tip - tip);
        out.put("lag_turn", r.ideal.tail - tail - (r.ideal.tip - tip));
        out.put("contact", contacts > 0 ? r.deepest.point - r.ideal.tip : Vec3(0));
        if (moves) put_body(out, is.body);
        if (tool) out.put("side", r.ideal_side);
      });
  return out;
}

double steps_of(const std::string& name) {
  if (name == "t") return kPerSecond;
  if (name.starts_with("force")) return kPerNewton;
  if (name.starts_with("moved_q") || name.starts_with("side")) return kPerUnit;
  if (name == "contacts" || name == "type" || name == "faults") return 1;
  return kPerMetre;
}

std::string stimulus_words(const data::IntervalRecord& shown) {
  if (shown.stimulus.empty()) return "nothing";
  return shown.stimulus + (shown.level ? ", level " + analysis::short_number(*shown.level) : "") +
         (shown.standard ? ", standard" : "");
}

std::string renderer_words(const std::string& renderer, bool other) {
  return (renderer == protocols::to_string(protocols::RendererKind::ray)) != other ? "ray"
                                                                                   : "point";
}

class PageBuilder {
 public:
  PageBuilder(const std::vector<WatchedTrial>& trials, bool compare)
      : trials_(trials), compare_(compare) {}

  TrialPage build() {
    std::size_t objects = 0;
    for (const WatchedTrial& one : trials_)
      objects += data::intervals_of(one.trial.stored.record).size();
    // An object's share of the page; each requested trial has at least one object.
    most_triangles_ =
        std::max<std::size_t>(kMostTriangles / std::max<std::size_t>(objects, 1), 300);
    for (const WatchedTrial& one : trials_) add(one);
    page_.html = html();
    return std::move(page_);
  }

 private:
  void note(const std::string& sentence) {
    if (std::ranges::find(page_.notes, sentence) == page_.notes.end())
      page_.notes.push_back(sentence);
  }

  Json pose_json(const Pose& pose) const {
    const Quat& q = pose.orientation;
    return {pose.position.x, pose.position.y, pose.position.z, q.w, q.x, q.y, q.z};
  }

  /// Returns the mesh's number; equal meshes are stored once.
  std::size_t add_mesh(const stimuli::ObjectSpec& object, const std::string& name) {
    const PictureMesh mesh = picture_mesh(object, most_triangles_);
    if (mesh.all_triangles > mesh.triangles.size())
      note("The picture of " + name + " has " + std::to_string(mesh.triangles.size()) + " of its " +
           std::to_string(mesh.all_triangles) + " triangles; forces and contacts use all of them.");
    if (object.soft)
      note(
          "A soft object is drawn at rest; contacts and forces are those of its surface as it "
          "gave way.");
    if (!object.material.layers.empty()) {
      std::vector<std::string> depths;
      for (const auto& layer : object.material.layers)
        depths.push_back(fixed(1000 * layer.depth, 1) + " mm");
      note("Of " + name + " the surface is drawn; it has " +
           counted(depths.size(), "layer", "layers") + " below it, from a depth of " +
           analysis::joined(depths) + ".");
    }
    std::vector<double> corners;
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t corner : triangle) corners.push_back(corner);
    WholeNumbers numbers;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (const Vec3& corner : mesh.corners) values.push_back(corner[axis]);
      // At least to 1/16,000 of 6 cm.
      const double size = std::max(1e-6, std::abs(*std::ranges::max_element(
                                             values, {}, [](double v) { return std::abs(v); })));
      numbers.add(std::string(1, "xyz"[axis]), values,
                  std::pow(10, std::ceil(4 - std::log10(size))));
    }
    numbers.add("corner", corners, 1);
    Json json = {{"columns", numbers.columns()}, {"data", numbers.text()}};
    const auto found = std::ranges::find(meshes_, json);
    if (found != meshes_.end()) return static_cast<std::size_t>(found - meshes_.begin());
    meshes_.push_back(std::move(json));
    return meshes_.size() - 1;
  }

  /// The object as it was seen, without noise: to be drawn beside the felt one.
  Json seen_json(const display::SeenTrial& sight, const std::string& label) {
    display::SeenTrial steady = sight;
    steady.seen.noise = 0;
    draws_seen_ = true;
    return {{"mesh", add_mesh(sight.object, label + ", as it was seen")},
            {"pose", pose_json(display::drawn_pose(steady, 0))},
            {"scale", sight.seen.size_ratio}};
  }

  Json parts_json(const session::RecordedTrial& trial, const ShownTicks& ticks, bool other) {
    const data::TrialRecord& record = trial.stored.record;
    const auto objects = session::shown_objects(trial.protocol, record);
    const auto sights = session::shown_sights(trial.protocol, record);
    const std::vector<data::IntervalRecord> intervals = data::intervals_of(record);
    Json parts = Json::array();
    for (std::size_t i = 0; i < ticks.intervals.size(); ++i) {
      std::string label = printable(stimulus_words(intervals[i]));
      if (i < objects.size() && objects[i] && objects[i]->texture)
        label += ", " + stimuli::in_words(*objects[i]->texture);
      Json part = {{"ticks", ticks.intervals[i]},
                   {"label", "interval " + std::to_string(i + 1) + ": " + label + ", " +
                                 renderer_words(intervals[i].renderer, other)},
                   {"mesh", nullptr}};
      if (objects[i] && objects[i]->shape != stimuli::ShapeKind::none &&
          session::is_felt(trial.protocol, intervals[i])) {
        part["mesh"] = add_mesh(*objects[i], label);
        part["pose"] = pose_json(objects[i]->pose);
      }
      if (sights[i] && sights[i]->seen.object) part["seen"] = seen_json(*sights[i], label);
      parts.push_back(std::move(part));
    }
    return parts;
  }

  static Json tool_json(const protocols::ToolSpec& tool) {
    Json segments = Json::array();
    for (const protocols::ToolSegmentSpec& one : tool.segments)
      segments.push_back({{one.from.x, one.from.y, one.from.z}, {one.to.x, one.to.y, one.to.z}});
    return segments;
  }

  static std::string answer_words(const data::TrialRecord& record) {
    const std::string after = " after " + fixed(record.response_time, 3) + " s";
    if (record.timed_out) return "no answer" + after;
    std::string words = "answered " + printable(record.response) + after;
    if (data::has_right_answer(record)) words += record.correct ? ", correct" : ", wrong";
    return words;
  }

  std::vector<std::string> facts(const WatchedTrial& one, const ShownTicks& ticks, bool other) {
    const session::RecordedTrial& trial = one.trial;
    std::vector<std::string> out;
    if (other) {
      out.push_back("SIMULATED COMPARISON: the recorded path of " + one.name +
                    " with the other renderer. With it, the hand would have moved differently.");
      return out;
    }
    const data::TrialRecord& record = trial.stored.record;
    out.push_back((trial.stored.participant.simulated ? "SIMULATED participant " : "Participant ") +
                  trial.stored.participant.code + ", study " +
                  printable(trial.stored.protocol_name) + (record.practice ? ", practice" : "") +
                  ": " + answer_words(record) + ".");
    const std::string all = counted(ticks.count, "tick", "ticks");
    if (ticks.equal == ticks.count) {
      out.push_back("Rendered again: all " + all + " equal the record, bit by bit.");
    } else {
      const std::string words = std::to_string(ticks.count - ticks.equal) + " of " + all +
                                " differ from the record when they are rendered again; forces are "
                                "the recorded ones, contacts those of palpate " PALPATE_VERSION ".";
      out.push_back(words);
      note(one.name + ": " + words);
    }
    if (trial.limited) out.emplace_back("The material was limited to what the device can show.");
    return out;
  }

  void add_show(const WatchedTrial& one, const ShownTicks& ticks, std::optional<std::size_t> path) {
    const bool other = path.has_value();
    const data::TrialRecord& record = one.trial.stored.record;
    WholeNumbers numbers;
    for (const auto& [name, values] : ticks.columns) numbers.add(name, values, steps_of(name));
    std::string title = one.name;
    if (record.task.of_block())
      title += other ? ", the other renderer" : ": " + record.task.task;
    else
      title += ": " + printable(record.shape) + ", " + renderer_words(record.renderer, other);
    Json show = {{"title", title},
                 {"facts", facts(one, ticks, other)},
                 {"parts", parts_json(one.trial, ticks, other)}};
    if (path) show["path"] = *path;
    const protocols::ToolSpec& tool = one.trial.protocol.tool;
    if (!tool.segments.empty()) show["tool"] = tool_json(tool);
    show["columns"] = numbers.columns();
    show["data"] = numbers.text();
    shows_.push_back(std::move(show));
    page_.ticks += ticks.count;
  }

  void add(const WatchedTrial& one) {
    const std::size_t number = shows_.size();
    add_show(one, ticks_of(one.trial, false), std::nullopt);
    if (compare_) add_show(one, ticks_of(one.trial, true), number);
  }

  Json document() const {
    Json types = Json::array(), faults = Json::array();
    for (const auto type :
         {rendering::ContactType::none, rendering::ContactType::point_polygon,
          rendering::ContactType::segment_edge, rendering::ContactType::segment_face})
      types.push_back(rendering::to_string(type));
    for (const rendering::FaultBit& fault : safety::kFaultTable)
      faults.push_back({fault.bit, fault.words});
    return {{"version", 1},
            {"program", PALPATE_VERSION},
            {"period", 1 / trials_.front().trial.protocol.servo_rate},
            {"types", types},
            {"faults", faults},
            {"meshes", meshes_},
            {"shows", shows_}};
  }

  bool simulated() const {
    return std::ranges::any_of(
        trials_, [](const WatchedTrial& one) { return one.trial.stored.participant.simulated; });
  }

  std::string title() const {
    std::vector<std::string> names;
    for (const WatchedTrial& one : trials_) names.push_back(one.name);
    return (names.size() == 1 ? "Trial " : "Trials ") + analysis::joined(names) +
           (compare_ ? ", with both renderers" : "");
  }

  std::string html() const {
    std::string json = document().dump();
    // Otherwise a text of a protocol could end the element.
    for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
      json.replace(at, 1, "\\u003c");
    const std::string label = simulated() ? "SIMULATED: " : "";
    std::string out =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src '" +
        analysis::script_hash(watch_js()) +
        "'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\"/>\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
        escaped(label + title()) + "</title>\n<link rel=\"icon\" href=\"data:,\"/>\n<style>";
    out += watch_css();
    out += "</style>\n</head>\n<body>\n";
    if (simulated())
      out += "<div class=\"flag\" role=\"note\">SIMULATED PARTICIPANT: no person felt this</div>\n";
    out += "<header>\n<h1>" + escaped(title()) +
           "</h1>\n<ul class=\"legend\">"
           "<li><i class=\"l-virtual\"></i>tool in the hand</li>"
           "<li><i class=\"l-ideal\"></i>ideal tool, kept outside</li>"
           "<li><i class=\"l-force\"></i>force on the hand, from the contact</li>"
           "<li><i class=\"l-touch\"></i>in contact</li>" +
           (draws_seen_ ? "<li><i class=\"l-seen\"></i>object as it was seen</li>" : "") +
           "</ul>\n</header>\n<main>\n"
           "<p id=\"loading\">This page draws with JavaScript.</p>\n"
           "<div id=\"controls\" class=\"controls\" hidden=\"hidden\">"
           "<button type=\"button\" id=\"play\">Play</button>"
           "<input type=\"range\" id=\"time\" min=\"0\" max=\"1\" step=\"any\" value=\"0\" "
           "aria-label=\"Time\"/><output id=\"clock\"></output>"
           "<select id=\"speed\" aria-label=\"Speed\">";
    for (const auto& [value, words] :
         {std::pair{"0.05", "1/20"}, std::pair{"0.1", "1/10"}, std::pair{"0.2", "1/5"},
          std::pair{"0.5", "1/2"}, std::pair{"1", "1"}, std::pair{"2", "2"}, std::pair{"4", "4"}})
      out += std::string("<option value=\"") + value + "\">speed " + words + "</option>";
    out +=
        "</select><button type=\"button\" id=\"solid\">Solid</button>"
        "<button type=\"button\" id=\"views\">Three views</button></div>\n"
        "<div id=\"shows\" class=\"shows\"></div>\n"
        "<p class=\"soft keys\">Keys: <kbd>Space</kbd> play or pause; <kbd>←</kbd> <kbd>→</kbd> 10 "
        "ticks, <kbd>,</kbd> <kbd>.</kbd> one tick; <kbd>Home</kbd> <kbd>End</kbd>; <kbd>[</kbd> "
        "<kbd>]</kbd> speed; <kbd>Shift</kbd> with an arrow turns, <kbd>+</kbd> <kbd>-</kbd> zoom, "
        "<kbd>0</kbd> resets the view; <kbd>V</kbd> changes it. Drag a picture to turn it, pinch "
        "or "
        "Ctrl and the wheel to come closer; drag in a plot to move in time.</p>\n</main>\n<footer>";
    for (const std::string& sentence : page_.notes) out += "<p>" + escaped(sentence) + "</p>\n";
    out +=
        "<p>World frame: x right, y away, z up. Places to 10 nm, forces to 10 µN, times to 1 µs; "
        "<code>palpate replay --out</code> has every digit. Made by palpate " PALPATE_VERSION
        ". This page is self-contained and loads nothing from the network.</p></footer>\n"
        "<script type=\"application/json\" id=\"ticks\">" +
        json + "</script>\n<script>";
    out += watch_js();
    return out + "</script>\n</body>\n</html>\n";
  }

  const std::vector<WatchedTrial>& trials_;
  bool compare_;
  std::size_t most_triangles_ = kMostTriangles;
  std::vector<Json> meshes_, shows_;
  bool draws_seen_ = false;  ///< an object beside the felt one
  TrialPage page_;
};

}  // namespace

PictureMesh picture_mesh(const stimuli::ObjectSpec& object, std::size_t most) {
  constexpr double kSame = 1e-6, kCoarser = 1.25;  // of the size
  const display::DrawnMesh drawn = display::triangles_of(object);
  const double size = size_of(drawn);
  PictureMesh mesh = clustered(drawn, kSame * size);
  const std::size_t all = mesh.triangles.size();
  // The corners of n triangles are some size / sqrt(n) apart.
  for (double cell = 0.5 * size / std::sqrt(static_cast<double>(most));
       mesh.triangles.size() > most; cell *= kCoarser)
    mesh = clustered(drawn, cell);
  mesh.all_triangles = all;
  return mesh;
}

TrialPage trial_page(const std::vector<WatchedTrial>& trials, bool compare) {
  return PageBuilder(trials, compare).build();
}

}  // namespace palpate::runner::touch
