#include "runner/display/console_view.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <glm/geometric.hpp>
#include <initializer_list>
#include <utility>

#include "runner/display/console_words.h"
#include "runner/safety/fault_signals.h"

namespace palpate::runner::display {
namespace {

constexpr double kNotch = 0.001;         // m
constexpr double kNotchPlane = 0.004;    // m
constexpr double kFirstPress = 0.0015;   // m; about 1 N at the usual stiffness
constexpr double kPlaneDistance = 0.08;  // m, of the plane; outside the usual home zones
constexpr double kMostPress = 0.03, kFarthest = 0.2;  // m
constexpr double kDepthPerPixel = 0.0004;             // m
constexpr double kTurnPerPixel = 0.006;               // rad

}  // namespace

PointerControl::PointerControl(devices::MouseStylus& device, const WorkspaceMap& workspace)
    : device_(device),
      workspace_(workspace),
      target_(device.initial_target()),
      press_depth_(kFirstPress),
      plane_distance_(kPlaneDistance) {
  target_.tip += workspace_.centre;
  device_.set_target(target_.stylus());
}

Vec3 PointerControl::wanted(const glm::vec2& pixel, const Camera& camera,
                            const LineOfSight& object) {
  const glm::vec3 eye = camera.eye();
  const glm::vec3 along = glm::normalize(camera.unproject(pixel, glm::vec3(0)) - eye);
  const std::optional<glm::vec3> surface = object(eye, along);
  if (touches_ && !surface) press_depth_ = kFirstPress;
  touches_ = surface.has_value();
  if (surface) return Vec3(*surface) + press_depth_ * Vec3(along);
  return Vec3(
      camera.unproject(pixel, static_cast<float>(plane_distance_) * camera.towards_viewer()));
}

void PointerControl::rest_at(const rendering::LineProbe& stylus) {
  const rendering::LineProbe there = workspace_.to_device(stylus);
  target_.point(there);
  was_over_ = false;
  device_.set_target(there);
}

void PointerControl::step(const PointerMotion& pointer, const Camera& camera,
                          const LineOfSight& object) {
  if (!pointer.over) {
    was_over_ = false;
    return;
  }
  const bool entered = !was_over_;
  if (entered) pointer_offset_ = {0, 0};
  was_over_ = true;
  const auto virtual_tip = [&] { return workspace_.to_virtual(target_.stylus()).tip; };
  const auto tip = [&] { return glm::vec3(virtual_tip()); };
  const auto follow = [&] {
    const Vec3 to = wanted(pointer.at - pointer_offset_, camera, object);
    const Vec3 by = (to - virtual_tip()) / workspace_.shift_gain();
    target_.move(by);
  };
  const double notches =
      pointer.wheel - (pointer.depth ? kDepthPerPixel / kNotch * pointer.moved.y : 0);
  if (touches_) {
    press_depth_ = std::clamp(press_depth_ + kNotch * notches, 0.0, kMostPress);
  } else {
    plane_distance_ = std::clamp(plane_distance_ - kNotchPlane * notches, -kFarthest, kFarthest);
  }
  if (pointer.orbit) {
    pointer_offset_ = pointer.at - camera.project(tip());
  } else if (pointer.turn) {
    target_.turn(kTurnPerPixel * pointer.moved.x, -kTurnPerPixel * pointer.moved.y);
    pointer_offset_ = pointer.at - camera.project(tip());
  } else if (entered || notches != 0 || (!pointer.depth && pointer.moved != glm::vec2(0, 0))) {
    follow();
  }
  device_.set_target(target_.stylus());
}

namespace {

constexpr double kThickness = 1.6;  // the view is small beside the panels

}  // namespace

SceneView::SceneView() : renderer_(SceneRenderer::live_quality()) {}

std::optional<glm::vec3> SceneView::hit(const glm::vec3& from, const glm::vec3& along) const {
  if (!drawing_) return std::nullopt;
  const auto found = drawing_->hit(from, along, poses_);
  if (!found) return std::nullopt;
  return found->place;
}

unsigned SceneView::draw(const Objects& objects, const rendering::Tool& tool,
                         const servo::Sample& sample, std::span<const rendering::BodyPose> bodies,
                         const Camera& camera, int width, int height) {
  if (objects != shown_ || !drawing_) {
    trouble_.clear();
    shown_ = objects;
    try {
      drawing_.emplace(objects != nullptr ? *objects : std::vector<stimuli::ObjectSpec>(), tool);
    } catch (const std::exception& fault) {
      trouble_ = fault.what();
      drawing_.emplace(std::vector<stimuli::ObjectSpec>(), tool);
    }
  }
  poses_.clear();
  if (objects != nullptr) poses_ = object_poses(*objects, bodies);
  SceneMoment moment{sample, {}};
  moment.poses = poses_;
  if (sample.rendering.contacts > 0)
    // Show the commanded force, which may be less than the rendered one.
    moment.contacts.push_back({sample.rendering.deepest.point, sample.device1 + sample.device2});
  ScenePicture picture = drawing_->picture(moment, dark_theme(), {.thickness = kThickness});
  picture.caption.clear();  // the console shows it beside the view
  return renderer_.draw(picture, camera, dark_theme(), width, height);
}

using namespace console_colour;

void coloured_text(const ImVec4& colour, const std::string& words) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextUnformatted(words.c_str(), words.c_str() + words.size());
  ImGui::PopStyleColor();
}

void table_row(const char* name, const std::string& value, const ImVec4& colour) {
  ImGui::TableNextColumn();  // starts a new row if the last one is full
  coloured_text(kQuiet, name);
  ImGui::TableNextColumn();
  coloured_text(colour, value);
}

std::string fixed_point(double value, int digits) {
  std::array<char, 40> out{};
  std::snprintf(out.data(), out.size(), "%.*f", digits, value);  // NOLINT: bounded
  return out.data();
}

bool wide_button(const char* words, float width, Look look) {
  if (look != Look::plain) {
    ImGui::PushStyleColor(ImGuiCol_Button, look == Look::due
                                               ? kDue
                                               : ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
  }
  const bool pressed = ImGui::Button(words, ImVec2(width, 2.0F * ImGui::GetFontSize()));
  if (look != Look::plain) ImGui::PopStyleColor();
  return pressed;
}

bool slider(const char* name, float& value, const SliderRange& range) {
  // Dear ImGui identifies the slider by the text after ###; the words before it change.
  const std::string words =
      std::string(name) + " " + fixed_point(value, range.digits) + range.unit + "###" + name;
  const bool moved = ImGui::SliderFloat(words.c_str(), &value, range.least, range.most, "",
                                        range.least > 0 ? ImGuiSliderFlags_Logarithmic : 0);
  const double power = std::pow(10, range.digits);
  if (moved) value = static_cast<float>(std::round(value * power) / power);
  return moved;
}

void wrapped_text(const ImVec4& colour, const std::string& words) {
  const float room = ImGui::GetContentRegionAvail().x;
  std::string line;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    const std::string longer = line + (line.empty() ? "" : " ") + words.substr(at, end - at);
    if (!line.empty() && ImGui::CalcTextSize(longer.c_str()).x > room) {
      coloured_text(colour, line);
      line = words.substr(at, end - at);
    } else {
      line = longer;
    }
    at = end + 1;
  }
  coloured_text(colour, line);
}

using namespace console_colour;
namespace {

using Kind = ConsoleCommand::Kind;

const char* label_of(ConsoleCommand::Kind kind) {
  return kind == ConsoleCommand::Kind::go_on          ? "Go on"
         : kind == ConsoleCommand::Kind::repeat_trial ? "Repeat"
                                                      : "End";
}

const char* label_of(Checklist::Step::State state) {
  switch (state) {
    case Checklist::Step::State::to_do:
      return "to do";
    case Checklist::Step::State::now:
      return "now";
    case Checklist::Step::State::done:
      return "done";
    case Checklist::Step::State::left_out:
      return "left out";
  }
  return "";
}

void draw_choices(const Checklist& list, EndRequest& ending,
                  std::vector<ConsoleCommand>& commands) {
  const float font = ImGui::GetFontSize(), gap = ImGui::GetStyle().ItemSpacing.x;
  const float room = ImGui::GetContentRegionAvail().x;
  float right = 0;
  for (const auto& [kind, meaning] : list.choices) {
    const std::string words = std::string(label_of(kind)) + ": " + meaning;
    const float width = std::max(10 * font, ImGui::CalcTextSize(words.c_str()).x + 2 * font);
    if (right > 0 && right + gap + width < room) {
      ImGui::SameLine();
      right += gap + width;
    } else {
      right = width;
    }
    if (!ImGui::Button(words.c_str(), {width, 2.4F * font})) continue;
    if (kind == Kind::quit) {
      ending.open = true;
    } else {
      commands.push_back({kind, {}, 0});
    }
  }
}

}  // namespace

void draw_checklist(const Checklist& list, EndRequest& ending,
                    std::vector<ConsoleCommand>& commands) {
  using State = Checklist::Step::State;
  const float font = ImGui::GetFontSize();
  std::size_t due = 0;
  while (due < list.steps.size() && list.steps[due].state != State::now) ++due;
  coloured_text(kQuiet, "Before the first trial: step " +
                            std::to_string(std::min(due + 1, list.steps.size())) + " of " +
                            std::to_string(list.steps.size()));
  ImGui::PushFont(ImGui::GetIO().Fonts->Fonts.back());
  std::string instruction = list.instruction;
  if (!instruction.empty() && instruction[0] >= 'a' && instruction[0] <= 'z') instruction[0] -= 32;
  wrapped_text(kBright, instruction);
  ImGui::PopFont();
  draw_choices(list, ending, commands);
  ImGui::Dummy({0, 0.4F * font});
  const auto& fonts = ImGui::GetIO().Fonts->Fonts;
  const bool small = ImGui::GetContentRegionAvail().y < 9 * font;
  ImGui::PushFont(small ? fonts.front() : fonts.back());
  if (ImGui::BeginTable("steps", 2)) {
    ImGui::TableSetupColumn("state", ImGuiTableColumnFlags_WidthFixed, 8 * font);
    ImGui::TableSetupColumn("step");
    for (const Checklist::Step& step : list.steps) {
      const bool now = step.state == State::now;
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      coloured_text(step.state == State::done ? kGood
                    : now                     ? kBright
                                              : kQuiet,
                    label_of(step.state));
      ImGui::TableNextColumn();
      coloured_text(now ? kBright : kQuiet, step.words);
    }
    ImGui::EndTable();
  }
  ImGui::PopFont();
}

namespace {

constexpr ImU32 kAxisColour = IM_COL32(153, 163, 176, 255);

/// The area of a plot within its titled frame, px.
struct Plot {
  ImVec2 from, to;
  ImDrawList* list;
};

double text_width(const std::string& words) { return ImGui::CalcTextSize(words.c_str()).x; }

/// The first name that fits the width of a plot, else the last.
const char* fitting(std::initializer_list<const char*> names, float width) {
  const char* last = "";
  for (const char* const name : names) {
    last = name;
    if (text_width(name) <= width - 1.2F * ImGui::GetFontSize()) break;
  }
  return last;
}

/// \param top  largest value of the axis; 0: no axis
Plot plot_frame(const char* name, float width, float height, double top = 0,
                const char* unit = "") {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float size = ImGui::GetFontSize();
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, {at.x + width, at.y + height}, ImGui::GetColorU32(ImGuiCol_FrameBg), 6);
  const std::string title = shortened(name, width - 1.2F * size, text_width);
  list->AddText({at.x + 0.6F * size, at.y + 0.4F * size}, kAxisColour, title.c_str());
  const Plot plot{{at.x + 3.6F * size, at.y + 2.0F * size},
                  {at.x + width - 0.8F * size, at.y + height - 0.8F * size},
                  list};
  for (int i = 0; i <= 2 && top > 0; ++i) {
    const float y = plot.to.y + (plot.from.y - plot.to.y) * static_cast<float>(i) / 2;
    list->AddLine({plot.from.x, y}, {plot.to.x, y}, IM_COL32(255, 255, 255, 26));
    const std::string label = axis_label(top * i / 2) + (i == 2 ? unit : "");
    const float wide = ImGui::CalcTextSize(label.c_str()).x;
    list->AddText({plot.from.x - wide - 6, y - size / 2}, kAxisColour, label.c_str());
  }
  ImGui::Dummy({width, height});
  return plot;
}

/// The next of 1, 2 or 5 times a power of ten.
double round_up(double value) {
  const double power = std::pow(10, std::floor(std::log10(std::max(value, 1e-3))));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * power) return step * power;
  }
  return 10 * power;
}

}  // namespace

void draw_forces(const std::deque<ForcePoint>& forces, float width, float height) {
  double most = 1;
  for (const ForcePoint& point : forces) most = std::max(most, point.force);
  const double top = round_up(most);
  const Plot plot = plot_frame(
      fitting({"Force on the hand, last 10 s", "Force, last 10 s", "Force, 10 s"}, width), width,
      height, top, " N");
  if (forces.size() < 2) return;
  std::vector<ImVec2> line;
  line.reserve(forces.size());
  for (const ForcePoint& point : forces) {
    const auto ago = static_cast<float>((forces.back().time - point.time) / 10);
    const auto high = static_cast<float>(point.force / top);
    line.emplace_back(plot.to.x - ago * (plot.to.x - plot.from.x),
                      plot.to.y - high * (plot.to.y - plot.from.y));
  }
  plot.list->AddPolyline(line.data(), static_cast<int>(line.size()), IM_COL32(247, 199, 66, 255), 0,
                         1.8F);
}

void draw_times(const std::vector<double>& times, float width, float height) {
  double most = 1;
  for (const double time : times) most = std::max(most, std::isfinite(time) ? time : 0);
  const double top = round_up(most);
  const Plot plot = plot_frame(fitting({"Response times so far", "Response times", "Times"}, width),
                               width, height, top, " s");
  const auto count = static_cast<float>(std::max<std::size_t>(times.size(), 20));
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) continue;
    const float x =
        plot.from.x + (static_cast<float>(i) + 0.5F) / count * (plot.to.x - plot.from.x);
    const float y =
        plot.to.y - static_cast<float>(std::max(times[i], 0.0) / top) * (plot.to.y - plot.from.y);
    plot.list->AddCircleFilled({x, y}, (times.size() > 200 ? 0.12F : 0.22F) * ImGui::GetFontSize(),
                               IM_COL32(116, 170, 217, 255));
  }
}

void draw_scores(const ConsoleState& state, float width, float height) {
  const std::vector<ShapeScore>& scores = state.scores;
  const char* const name = state.counts_right
                               ? fitting({"Correct, without practice", "Correct"}, width)
                               : fitting({"Answers, without practice", "Answers"}, width);
  const Plot plot = plot_frame(name, width, height);
  int most = 1;
  for (const ShapeScore& score : scores) most = std::max(most, score.answered);
  const float line = ImGui::GetTextLineHeight();
  const float each =
      std::min(1.5F * line, (plot.to.y - plot.from.y) /
                                static_cast<float>(std::max<std::size_t>(scores.size(), 1)));
  const float left = plot.from.x - 2.8F * line, wide = plot.to.x - left;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const ShapeScore& score = scores[i];
    const float y = plot.from.y + static_cast<float>(i) * each;
    const int whole = state.counts_right ? std::max(score.shown, 1) : most;
    const int part = state.counts_right ? score.right : score.answered;
    const float fraction = static_cast<float>(part) / static_cast<float>(whole);
    plot.list->AddRectFilled({left, y}, {left + fraction * wide, y + 0.86F * each},
                             IM_COL32(60, 92, 120, 255), 3);
    const float size = std::min(line, 0.86F * each);
    const auto write = [&](float x, const std::string& words) {
      plot.list->AddText(ImGui::GetFont(), size, {x, y + (0.86F * each - size) / 2},
                         IM_COL32(235, 233, 226, 255), words.c_str());
    };
    const std::string count =
        state.counts_right ? std::to_string(score.right) + " of " + std::to_string(score.shown)
                           : std::to_string(score.answered);
    const auto counted = static_cast<float>(text_width(count)) * size / line;
    write(plot.to.x - counted - 6, count);
    const double room = (wide - counted - 18) * line / size;
    write(left + 6, shortened(score.shape, room, text_width));
  }
}

using namespace console_colour;
namespace {

bool off(const ConsoleState& state) {
  return (state.sample.faults & servo::servo_fault::kTripped) != 0;
}

void progress(const ConsoleState& state) {
  ImGui::ProgressBar(static_cast<float>(fraction_done(state)), {-1, 6}, "");
}

/// The study and the state of the session. Words that do not fit beside the state replace the study
/// above it: no button may move when the words change.
void headline(const ConsoleState& state) {
  const float font = ImGui::GetFontSize(), gap = ImGui::GetStyle().ItemSpacing.x;
  const float room = ImGui::GetContentRegionAvail().x;
  const ImVec4 colour = state.stop_plan.empty() ? kBright : kBad;
  const std::string title = state_title(state), detail = state_detail(state);
  ImFont* const large = ImGui::GetIO().Fonts->Fonts.back();
  ImGui::PushFont(large);
  const double titled = text_width(title);
  ImGui::PopFont();
  const bool beside = titled + gap + text_width(detail) <= room;
  const std::string study =
      state.study + "  ·  " + state.participant + "  ·  session " + std::to_string(state.session);
  coloured_text(beside ? kQuiet : colour, shortened(beside ? study : detail, room, text_width));
  ImGui::PushFont(large);
  coloured_text(state.state == "fault" ? kBad : kBright, shortened(title, room, text_width));
  ImGui::PopFont();
  if (!beside) return;
  const ImVec2 corner = ImGui::GetItemRectMax();
  ImGui::GetWindowDrawList()->AddText({corner.x + gap, corner.y - 1.35F * font},
                                      ImGui::GetColorU32(colour), detail.c_str());
}

std::string of(int number, int all) {
  return all > 0 ? std::to_string(number) + " of " + std::to_string(all) : "-";
}

/// A table of names and values. \param compact  two values in a row
bool begin_values(const char* name, bool compact) {
  if (!ImGui::BeginTable(name, compact ? 4 : 2)) return false;
  for (int i = 0; i < (compact ? 2 : 1); ++i) {
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed,
                            (compact ? 6.0F : 7.5F) * ImGui::GetFontSize());
    ImGui::TableSetupColumn("value");
  }
  return true;
}

}  // namespace

void draw_status(const ConsoleState& state, bool hidden, bool compact) {
  if (compact && !state.checklist.steps.empty()) return;  // no trial yet: the space is needed
  headline(state);
  progress(state);
  if (!begin_values("status", compact)) return;
  const bool practice = state.practice && (state.state == "trial" || state.state == "homing");
  table_row("Trial", trial_of(state) + (practice ? "  PRACTICE" : ""), practice ? kGood : kBright);
  table_row("Block", of(state.block, state.blocks));
  table_row("Stimulus", state.shape.empty() ? "-" : hidden ? "hidden" : state.shape);
  table_row("Renderer", state.renderer.empty() ? "-" : state.renderer);
  if (!state.task.empty()) {
    table_row("Task", state.task + ", interval " + of(state.interval, state.intervals));
    table_row("Level", state.level.empty() ? "-" : hidden ? "hidden" : level_text(state));
  }
  table_row("Last answer", state.answer.empty() ? "-" : hidden ? "hidden" : state.answer);
  table_row("Time",
            duration_text(state.elapsed) +
                (state.remaining > 0 ? ", about " + duration_text(state.remaining) + " left" : ""));
  ImGui::EndTable();
}

namespace {

using Kind = ConsoleCommand::Kind;

void draw_ending(EndRequest& ending, float half, std::vector<ConsoleCommand>& commands) {
  if (!std::exchange(ending.shown, true)) ImGui::SetScrollHereY(0);  // in a small window
  ImGui::PushTextWrapPos(0);
  coloured_text(kBright,
                "End the session now? The trial under way is cut off. All answers are stored; "
                "the session can be resumed unless the participant withdraws.");
  ImGui::PopTextWrapPos();
  ImGui::SetNextItemWidth(-1);
  ImGui::InputTextWithHint("##why", "Reason, stored in the record", ending.reason.data(),
                           ending.reason.size());
  const auto end = [&](const char* words, const std::string& why) {
    if (!wide_button(words, half)) return;
    commands.push_back({Kind::quit, why, 0});
    ending = {};
  };
  end("End the session", ending.reason.data());
  ImGui::SameLine();
  if (wide_button("Back", half)) ending = {};
  end("Participant withdraws", "withdrawn");
}

void draw_correction(const ConsoleState& state, Correction& correction, float half,
                     std::vector<ConsoleCommand>& commands) {
  correction.at = std::min(correction.at, state.given.size() - 1);
  const GivenAnswer& one = state.given[correction.at];
  wrapped_text(kBright, one.page + ", " + one.question + ": " +
                            (one.answer.empty() ? "(left out)" : one.answer));
  const auto turn = [&](const char* words, std::size_t to) {
    ImGui::BeginDisabled(to >= state.given.size());
    if (wide_button(words, half)) {
      correction.at = to;
      correction.answer = {};
    }
    ImGui::EndDisabled();
  };
  turn("Answer before", correction.at - 1);  // wraps to a large number at the first
  ImGui::SameLine();
  turn("Next answer", correction.at + 1);
  ImGui::SetNextItemWidth(-1);
  ImGui::InputTextWithHint("##corrected", "The right answer; the one before stays on record",
                           correction.answer.data(), correction.answer.size());
  if (wide_button("Store the correction", half)) {
    const std::string answer = correction.answer.data();
    commands.push_back({Kind::correct, one.page + " " + one.question + " " + answer, 0});
    correction = {};
  }
  ImGui::SameLine();
  if (wide_button("Back", half)) correction = {};
}

}  // namespace

void draw_buttons(const ConsoleState& state, bool compact, EndRequest& ending,
                  Correction& correction, std::vector<ConsoleCommand>& commands) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float half = (ImGui::GetContentRegionAvail().x - gap) / 2;
  if (ending.open) {
    draw_ending(ending, half, commands);
    return;
  }
  if (correction.open && !state.given.empty()) {
    draw_correction(state, correction, half, commands);
    return;
  }
  if (compact && !state.checklist.steps.empty()) {
    if (wide_button("End now...", half)) ending.open = true;
    return;
  }
  const auto button = [&](const char* words, Kind kind, bool lit = false, bool due = false) {
    const Look look = due ? Look::due : lit ? Look::lit : Look::plain;
    if (wide_button(words, half, look)) commands.push_back({kind, {}, 0});
  };
  const bool in_trial = state.state == "trial" || state.state == "homing";
  button(in_trial ? "Pause after trial" : "Pause", Kind::pause,
         state.pauses || state.state == "paused");
  ImGui::SameLine();
  button("Go on", Kind::go_on, false, !state.held_by.empty() && !off(state));
  button("Stop after trial", Kind::stop_after_trial, state.stop_plan == "after this trial");
  ImGui::SameLine();
  button("Stop after block", Kind::stop_after_block, state.stop_plan == "after this block");
  button("Repeat trial", Kind::repeat_trial);
  ImGui::SameLine();
  if (wide_button("End now...", half)) ending.open = true;
  if (!state.given.empty() && wide_button(button_label(Kind::correct), half))
    correction.open = true;
}

float draw_emergency(bool lit) {
  const float font = ImGui::GetFontSize();
  const ImGuiViewport& all = *ImGui::GetMainViewport();
  const float room = all.WorkSize.x, gap = std::min(8.0F, 0.02F * room);
  const float height = std::min(3.4F * font, all.WorkSize.y);
  const ImVec2 from{all.WorkPos.x + gap, all.WorkPos.y + gap};
  const ImVec2 to{all.WorkPos.x + room - gap, all.WorkPos.y + height};
  ImDrawList& list = *ImGui::GetForegroundDrawList();
  list.AddRectFilled(all.WorkPos, {all.WorkPos.x + room, to.y + gap},
                     ImGui::GetColorU32(ImGuiCol_WindowBg));
  list.AddRectFilled(from, to, ImGui::GetColorU32(lit ? kRedLit : kRed), 6);
  const auto wide = [](const char* words) { return ImGui::CalcTextSize(words).x; };
  const char* words = "EMERGENCY: ZERO FORCE   (F12 or Esc)";
  if (wide(words) > to.x - from.x) words = "EMERGENCY";
  const float fits = std::min(
      {1.4F, 0.96F * (to.x - from.x) / std::max(wide(words), 1.0F), (to.y - from.y) / font});
  const float size = fits * font;
  list.AddText(ImGui::GetFont(), size,
               {(from.x + to.x - fits * wide(words)) / 2, (from.y + to.y - size) / 2},
               ImGui::GetColorU32(kBright), words);
  return to.y + gap;
}

void draw_forces_off(const ConsoleState& state, double silence,
                     std::vector<ConsoleCommand>& commands) {
  // Always shown, so that no other button moves when forces go off.
  const float font = ImGui::GetFontSize(), room = ImGui::GetContentRegionAvail().x;
  const float clear = 8 * font, gap = ImGui::GetStyle().ItemSpacing.x;
  const float wide = (room - clear) / font;
  const float lines = wide < 18 ? 6.25F : wide < 24 ? 4.25F : 3.25F;
  ImGui::BeginChild("forces", {room - clear - gap, lines * font});
  ImGui::PushTextWrapPos(0);
  if (silence > 0) {
    coloured_text(kBad, "No update from the session for " + duration_text(silence));
  } else {
    const bool alarm = off(state) && !forces_not_yet_on(state);
    coloured_text(alarm ? kBad : state.held_by.empty() ? kQuiet : kBright, forces_text(state));
  }
  ImGui::PopTextWrapPos();
  ImGui::EndChild();
  ImGui::SameLine();
  ImGui::BeginDisabled(!off(state));
  const Look look = off(state) && !forces_not_yet_on(state) ? Look::due : Look::plain;
  if (wide_button("Clear the fault", clear, look)) commands.push_back({Kind::clear_fault, {}, 0});
  ImGui::EndDisabled();
}

float health_height() {
  return 6 * (ImGui::GetTextLineHeight() + 2 * ImGui::GetStyle().CellPadding.y);
}

void draw_health(const ConsoleState& state, bool compact) {
  const servo::Sample& sample = state.sample;
  if (!begin_values("health", compact)) return;
  const std::string faults = safety::fault_words(sample.faults);
  table_row("Servo", faults.empty() ? "no fault" : faults,
            faults.empty()             ? kGood
            : forces_not_yet_on(state) ? kQuiet
                                       : kBad);
  table_row("Period", fixed_point(static_cast<double>(sample.period_ns) * 1e-6, 3) +
                          (compact ? " ms, up to " : " ms, longest ") +
                          fixed_point(static_cast<double>(state.longest_period_ns) * 1e-6, 2) +
                          " ms");
  table_row("Computing", fixed_point(static_cast<double>(sample.compute_ns) * 1e-3, 1) + " µs");
  table_row("Missed",
            std::to_string(state.missed_ticks) + " of " + std::to_string(state.ticks) +
                (compact ? "" : " ticks"),
            state.missed_ticks == 0 ? kBright : kBad);
  table_row("Force", fixed_point(glm::length(sample.device1), 2) +
                         (compact ? " N tip, " : " N at the tip, ") +
                         fixed_point(glm::length(sample.device2), 2) +
                         (compact ? " N tail" : " N at the tail"));
  table_row("Contact", sample.rendering.contacts == 0
                           ? "none"
                           : fixed_point(sample.rendering.deepest.depth * 1e3, 2) + " mm deep");
  ImGui::EndTable();
}

namespace {

constexpr double kForceSpan = 10;  // s, shown in the plot
constexpr double kSilence = 1;     // s; a longer silence is reported

}  // namespace

// The user of the mouse device must see the scene.
ConsoleView::ConsoleView(const WindowSettings& settings, bool shared)
    : shared_(shared && settings.mouse == nullptr), hidden_(shared_) {
  if (settings.mouse != nullptr) control_.emplace(*settings.mouse, settings.workspace);
}

void ConsoleView::share(bool shared) {
  shared = shared && !control_;
  if (shared != shared_) hidden_ = shared;
  shared_ = shared;
}

void ConsoleView::update(ConsoleState state, double now) {
  state_ = std::move(state);
  updated_at_ = now;
  has_state_ = true;
  const double time = static_cast<double>(state_.sample.time_ns) * 1e-9;
  const double force = glm::length(state_.sample.device1 + state_.sample.device2);
  if (!forces_.empty() && time < forces_.back().time) forces_.clear();
  if (!forces_.empty() && time == forces_.back().time) forces_.pop_back();
  forces_.push_back({time, std::isfinite(force) ? force : 0});
  while (forces_.front().time < time - kForceSpan) forces_.pop_front();
}

std::vector<ConsoleCommand> ConsoleView::draw(double now, const Modifiers& modifiers) {
  std::vector<ConsoleCommand> commands;
  const ImGuiViewport* const all = ImGui::GetMainViewport();
  emergency_bottom_ = draw_emergency(emergency_highlit_);
  ImGui::SetNextWindowPos({all->WorkPos.x, all->WorkPos.y + emergency_bottom_});
  ImGui::SetNextWindowSize({all->WorkSize.x, std::max(all->WorkSize.y - emergency_bottom_, 1.0F)});
  ImGui::Begin("console", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
  const float font = ImGui::GetFontSize();
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const ImVec2 room = ImGui::GetContentRegionAvail();
  const bool narrow = room.x < 44 * font;
  const float side = std::clamp(0.36F * room.x, 22 * font, 30 * font);
  const bool checks = !state_.checklist.steps.empty();
  const float least = (checks || !hidden_ ? 7.5F : 6.5F) * font;
  const float high = std::clamp(room.y - controls_ - min_notes_height() - gap, least,
                                std::max(least, (checks ? 0.6F : 0.45F) * room.y));
  ImGui::BeginChild("picture", narrow ? ImVec2{0, high} : ImVec2{room.x - side - gap, 0}, false,
                    ImGuiWindowFlags_NoScrollbar);
  draw_picture(modifiers, !narrow, commands);
  ImGui::EndChild();
  if (!narrow) ImGui::SameLine();
  ImGui::BeginChild("side", {0, 0}, false, ImGuiWindowFlags_NoScrollbar);
  draw_side(now, narrow, commands);
  ImGui::EndChild();
  ImGui::End();
  return commands;
}

void ConsoleView::draw_picture(const Modifiers& modifiers, bool with_plots,
                               std::vector<ConsoleCommand>& commands) {
  const float font = ImGui::GetFontSize();
  const ImVec2 spacing = ImGui::GetStyle().ItemSpacing;
  const ImVec2 room = ImGui::GetContentRegionAvail();
  const float plots = with_plots ? std::clamp(0.22F * room.y, 6 * font, 12 * font) : 0;
  const float width = std::max(room.x, 40.0F);
  const float readings = readings_are_in_picture(with_plots) ? health_height() + spacing.y : 0;
  const float height = std::max(room.y - readings - (with_plots ? plots + spacing.y : 0), 40.0F);
  if (!state_.checklist.steps.empty()) {
    ImGui::BeginChild("checklist", {width, height});
    draw_checklist(state_.checklist, end_request_, commands);
    ImGui::EndChild();
  } else if (hidden_) {
    draw_hidden(width, height);
  } else {
    draw_view(modifiers, width, height);
  }
  if (readings > 0) draw_health(state_, false);
  if (!with_plots) return;
  const float plots_beside = hidden_ ? 2 : 3;
  const float part = (room.x - spacing.x * (plots_beside - 1)) / plots_beside;
  draw_forces(forces_, part, plots);
  ImGui::SameLine();
  draw_times(state_.times, part, plots);
  if (hidden_) return;
  ImGui::SameLine();
  draw_scores(state_, part, plots);
}

void ConsoleView::draw_hidden(float width, float height) {
  const float font = ImGui::GetFontSize();
  ImGui::PushStyleColor(ImGuiCol_ChildBg, ImGui::GetStyleColorVec4(ImGuiCol_FrameBg));
  ImGui::BeginChild("hidden", {width, height}, false, ImGuiWindowFlags_AlwaysUseWindowPadding);
  ImGui::Dummy({0, std::max(0.0F, height / 2 - 6 * font)});
  ImGui::PushTextWrapPos(0);
  ImGui::TextUnformatted(
      "One monitor: shape, scene and whether answers are correct are hidden here, because the "
      "participant may see this window.");
  ImGui::PopTextWrapPos();
  if (ImGui::Button("Show them", {10 * font, 2 * font})) hidden_ = false;
  ImGui::EndChild();
  ImGui::PopStyleColor();
}

void ConsoleView::draw_view(const Modifiers& modifiers, float width, float height) {
  const float font = ImGui::GetFontSize();
  camera_.resize(width, height);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const ImVec2 scale = ImGui::GetIO().DisplayFramebufferScale;
  const unsigned texture =
      scene_.draw(state_.objects, state_.tool, state_.sample, state_.bodies, camera_,
                  static_cast<int>(width * scale.x), static_cast<int>(height * scale.y));
  // OpenGL textures have their origin at the lower left.
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the identity that the OpenGL back end asks for
  const auto picture = reinterpret_cast<ImTextureID>(std::uintptr_t{texture});
  ImGui::GetWindowDrawList()->AddImageRounded(picture, at, {at.x + width, at.y + height}, {0, 1},
                                              {1, 0}, IM_COL32_WHITE, 6);
  ImGui::InvisibleButton("view", {width, height},
                         ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  ImGui::SetItemAllowOverlap();  // so that the button drawn over it works
  const ImGuiIO& io = ImGui::GetIO();
  PointerMotion pointer;
  pointer.over = ImGui::IsItemHovered() || ImGui::IsItemActive();
  pointer.at = {io.MousePos.x - at.x, io.MousePos.y - at.y};
  pointer.moved = {io.MouseDelta.x, io.MouseDelta.y};
  pointer.wheel = ImGui::IsItemHovered() ? io.MouseWheel : 0;
  pointer.orbit =
      ImGui::IsItemActive() && (ImGui::IsMouseDown(ImGuiMouseButton_Right) ||
                                (!control_ && ImGui::IsMouseDown(ImGuiMouseButton_Left)));
  pointer.turn =
      modifiers.ctrl || (ImGui::IsItemActive() && ImGui::IsMouseDown(ImGuiMouseButton_Left));
  pointer.depth = modifiers.shift;
  if (pointer.orbit) camera_.orbit(-0.008F * pointer.moved.x, 0.008F * pointer.moved.y);
  if (control_) {
    control_->step(pointer, camera_, [this](const glm::vec3& from, const glm::vec3& along) {
      return scene_.hit(from, along);
    });
  }

  const auto label = [&](float line, const std::string& words, ImU32 colour) {
    ImGui::GetWindowDrawList()->AddText({at.x + 0.8F * font, at.y + (0.6F + 1.4F * line) * font},
                                        colour, words.c_str());
  };
  if (!scene_.trouble().empty()) label(0, scene_.trouble(), IM_COL32(247, 117, 102, 255));
  const float last = (height / font - 2.1F) / 1.4F;
  const ImU32 quiet = IM_COL32(150, 158, 168, 255);
  if (control_) {
    const float wide = width - 1.6F * font;
    label(last - 1,
          fitting({"pointer: the tip, on what is under it     wheel or Shift: press harder",
                   "pointer: the tip     wheel or Shift: press harder", "wheel or Shift: press"},
                  wide),
          quiet);
    label(last,
          fitting({"Ctrl or left button: turn     right button: look around", "Ctrl: turn"}, wide),
          quiet);
  } else {
    label(last, "drag: look around", quiet);
  }
  if (!shared_) return;
  ImGui::SetCursorScreenPos({at.x + width - 7 * font, at.y + 0.6F * font});
  if (ImGui::Button("Hide", {6.4F * font, 2 * font})) hidden_ = true;
  ImGui::SetCursorScreenPos({at.x, at.y + height + ImGui::GetStyle().ItemSpacing.y});
}

float ConsoleView::min_notes_height() {
  return 5.5F * ImGui::GetFontSize() + ImGui::GetFrameHeightWithSpacing() +
         ImGui::GetStyle().ItemSpacing.y;
}

// The readings of the servo stand below the picture, where all buttons stay in sight beside them;
// in a low or narrow window they follow the buttons.
bool ConsoleView::readings_are_in_picture(bool wide) {
  constexpr float kLeastLines = 36;
  return wide && ImGui::GetMainViewport()->WorkSize.y > kLeastLines * ImGui::GetFontSize();
}

// In a small window the controls scroll; the newest message stays visible.
void ConsoleView::draw_side(double now, bool narrow, std::vector<ConsoleCommand>& commands) {
  const float room = ImGui::GetContentRegionAvail().y;
  const float notes = std::max(min_notes_height(), room - controls_);
  ImGui::BeginChild("controls", {0, std::max(room - notes, 1.0F)});
  draw_forces_off(state_, has_state_ && now - updated_at_ > kSilence ? now - updated_at_ : 0,
                  commands);
  draw_status(state_, hidden_, narrow);
  draw_buttons(state_, narrow, end_request_, correction_, commands);
  const bool crowded =
      narrow && (end_request_.open || correction_.open || !state_.checklist.steps.empty());
  if (!crowded && !readings_are_in_picture(!narrow)) draw_health(state_, narrow);
  ImGui::Dummy({0, 2});
  controls_ = ImGui::GetCursorPosY();
  ImGui::EndChild();
  draw_notes(commands);
}

void ConsoleView::draw_answer(std::vector<ConsoleCommand>& commands) {
  if (!state_.takes_answers) return;
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::InputTextWithHint("##answer", "The answer that was spoken; Enter", answer_.data(),
                                answer_.size(), ImGuiInputTextFlags_EnterReturnsTrue))
    return;
  commands.push_back({ConsoleCommand::Kind::answer, answer_.data(), 0});
  answer_.fill(0);
  ImGui::SetKeyboardFocusHere(-1);  // for the next one
}

void ConsoleView::draw_notes(std::vector<ConsoleCommand>& commands) {
  const float field = (state_.takes_answers ? 2.0F : 1.0F) * ImGui::GetFrameHeightWithSpacing();
  const float room = std::max(ImGui::GetContentRegionAvail().y - field, ImGui::GetFontSize());
  ImGui::PushStyleColor(ImGuiCol_ChildBg, ImGui::GetStyleColorVec4(ImGuiCol_FrameBg));
  ImGui::BeginChild(
      "messages", {0, room}, false,
      ImGuiWindowFlags_AlwaysUseWindowPadding | ImGuiWindowFlags_AlwaysVerticalScrollbar);
  ImGui::PushTextWrapPos(0);
  for (const std::string& message : state_.messages) {
    const bool newest = &message == &state_.messages.back();
    ImGui::PushStyleColor(ImGuiCol_Text,
                          ImGui::GetStyleColorVec4(newest ? ImGuiCol_Text : ImGuiCol_TextDisabled));
    ImGui::TextUnformatted(message.c_str(), message.c_str() + message.size());
    ImGui::PopStyleColor();
  }
  ImGui::PopTextWrapPos();
  // The full height is known only a frame after the message was first drawn.
  const std::size_t count = state_.older_messages + state_.messages.size();
  if (count != messages_seen_) frames_to_scroll_ = 3;
  messages_seen_ = count;
  if (frames_to_scroll_ > 0) {
    ImGui::SetScrollY(ImGui::GetScrollMaxY());
    --frames_to_scroll_;
  }
  ImGui::EndChild();
  ImGui::PopStyleColor();
  draw_answer(commands);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::InputTextWithHint("##note", "A note, stored with its time; Enter", note_.data(),
                               note_.size(), ImGuiInputTextFlags_EnterReturnsTrue)) {
    if (note_[0] != 0) commands.push_back({ConsoleCommand::Kind::note, note_.data(), 0});
    note_.fill(0);
  }
}

}  // namespace palpate::runner::display
