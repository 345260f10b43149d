#include "runner/display/console_panels.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>
#include <utility>

#include "runner/display/console_elements.h"
#include "runner/display/console_words.h"
#include "runner/safety/fault_signals.h"
#include "stimuli/texture.h"

namespace palpate::runner::display {
namespace {

using namespace console_colour;
using Kind = ConsoleCommand::Kind;

const char* label_of(ConsoleCommand::Kind kind) {
  return kind == ConsoleCommand::Kind::resume         ? "Go on"
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

constexpr ImU32 kAxisColour = IM_COL32(153, 163, 176, 255);

/// The area of a plot within its titled frame, px.
struct Plot {
  ImVec2 from, to;
  ImDrawList* list;
};

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

void draw_status(const ConsoleState& state, bool hidden, bool compact) {
  if (compact && !state.checklist.steps.empty()) return;  // no trial yet: the space is needed
  headline(state);
  progress(state);
  if (!begin_values("status", compact)) return;
  const bool practice = state.practice && (state.state == "trial" || state.state == "homing");
  table_row("Trial", trial_of(state) + (practice ? "  PRACTICE" : ""), practice ? kGood : kBright);
  table_row("Block", of(state.block, state.blocks));
  table_row("Stimulus", state.shape.empty() ? "-" : hidden ? "hidden" : state.shape);
  const bool placed = state.objects != nullptr && !state.objects->empty();
  if (placed && state.objects->front().texture && !hidden)
    table_row("Texture", stimuli::in_words(*state.objects->front().texture));
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
  button("Go on", Kind::resume, false, !state.held_by.empty() && !off(state));
  button("Stop after trial", Kind::stop_after_trial, state.stop_plan == "after this trial");
  ImGui::SameLine();
  button("Stop after block", Kind::stop_after_block, state.stop_plan == "after this block");
  button("Repeat trial", Kind::repeat_trial);
  ImGui::SameLine();
  if (wide_button("End now...", half)) ending.open = true;
  if (!state.given.empty() && wide_button(button_label(Kind::correct), half))
    correction.open = true;
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

float health_height(const ConsoleState& state) {
  return (state.field_power ? 7.0F : 6.0F) *
         (ImGui::GetTextLineHeight() + 2 * ImGui::GetStyle().CellPadding.y);
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
  if (state.field_power) table_row("Fields", power_words(*state.field_power));
  ImGui::EndTable();
}

}  // namespace palpate::runner::display
