#include "runner/display/console_panels.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "runner/display/console_widgets.h"
#include "runner/display/console_words.h"
#include "runner/safety/fault_table.h"

namespace palpate::runner {

using namespace console_colour;
namespace {

bool off(const ConsoleState& state) { return (state.sample.faults & servo_fault::kTripped) != 0; }

void progress(const ConsoleState& state) {
  ImGui::ProgressBar(static_cast<float>(fraction_done(state)), {-1, 6}, "");
}

void title(const ConsoleState& state) {
  const float font = ImGui::GetFontSize();
  ImGui::PushFont(ImGui::GetIO().Fonts->Fonts.back());
  coloured_text(state.state == "fault" ? kBad : kBright, state_title(state));
  ImGui::PopFont();
  const ImVec2 corner = ImGui::GetItemRectMax();
  ImGui::GetWindowDrawList()->AddText(
      {corner.x + ImGui::GetStyle().ItemSpacing.x, corner.y - 1.35F * font},
      ImGui::GetColorU32(state.stop_plan.empty() ? kBright : kBad), state_detail(state).c_str());
}

std::string of(int number, int all) {
  return all > 0 ? std::to_string(number) + " of " + std::to_string(all) : "-";
}

}  // namespace

void draw_status(const ConsoleState& state, bool hidden, bool compact) {
  if (compact && !state.checklist.steps.empty()) return;  // no trial yet: the space is needed
  coloured_text(kQuiet, state.study + "  ·  " + state.participant + "  ·  session " +
                            std::to_string(state.session));
  title(state);
  progress(state);
  if (!ImGui::BeginTable("status", compact ? 4 : 2)) return;
  for (int i = 0; i < (compact ? 2 : 1); ++i) {
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed,
                            (compact ? 6.0F : 7.5F) * ImGui::GetFontSize());
    ImGui::TableSetupColumn("value");
  }
  const bool practice = state.practice && (state.state == "trial" || state.state == "homing");
  table_row("Trial", of(state.trial, state.trials) + (practice ? "  PRACTICE" : ""),
            practice ? kGood : kBright);
  table_row("Block", of(state.block, state.blocks));
  table_row("Shape", state.shape.empty() ? "-" : hidden ? "hidden" : state.shape);
  table_row("Renderer", state.renderer.empty() ? "-" : state.renderer);
  if (!state.task.empty()) {
    table_row("Task", state.task + ", interval " + of(state.interval, state.intervals));
    table_row("Level", state.level.empty() ? "-" : hidden ? "hidden" : state.level);
  }
  table_row("Last answer", state.answer.empty() ? "-" : hidden ? "hidden" : state.answer);
  table_row("Elapsed", duration_text(state.elapsed));
  table_row("Remaining",
            state.remaining > 0 ? "about " + duration_text(state.remaining) : "not known yet");
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

}  // namespace

void draw_buttons(const ConsoleState& state, bool compact, EndRequest& ending,
                  std::vector<ConsoleCommand>& commands) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float half = (ImGui::GetContentRegionAvail().x - gap) / 2;
  if (ending.open) {
    draw_ending(ending, half, commands);
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
  button("Pause", Kind::pause, state.state == "paused");
  ImGui::SameLine();
  button("Go on", Kind::go_on, false, !state.held_by.empty() && !off(state));
  button("Stop after trial", Kind::stop_after_trial, state.stop_plan == "after this trial");
  ImGui::SameLine();
  button("Stop after block", Kind::stop_after_block, state.stop_plan == "after this block");
  button("Repeat trial", Kind::repeat_trial);
  ImGui::SameLine();
  if (wide_button("End now...", half)) ending.open = true;
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

void draw_health(const ConsoleState& state, bool brief) {
  const Sample& sample = state.sample;
  if (!ImGui::BeginTable("health", 2)) return;
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 7.5F * ImGui::GetFontSize());
  ImGui::TableSetupColumn("value");
  const std::string faults = fault_words(sample.faults);
  table_row("Servo", faults.empty() ? "no fault" : faults,
            faults.empty()             ? kGood
            : forces_not_yet_on(state) ? kQuiet
                                       : kBad);
  if (brief) {
    ImGui::EndTable();
    return;
  }
  table_row("Period",
            fixed_point(static_cast<double>(sample.period_ns) * 1e-6, 3) + " ms, longest " +
                fixed_point(static_cast<double>(state.longest_period_ns) * 1e-6, 2) + " ms");
  table_row("Computing", fixed_point(static_cast<double>(sample.compute_ns) * 1e-3, 1) + " µs");
  table_row("Missed",
            std::to_string(state.missed_ticks) + " of " + std::to_string(state.ticks) + " ticks",
            state.missed_ticks == 0 ? kBright : kBad);
  table_row("Force", fixed_point(glm::length(sample.device1), 2) + " N at the tip, " +
                         fixed_point(glm::length(sample.device2), 2) + " N at the tail");
  table_row("Contact", sample.rendering.contacts == 0
                           ? "none"
                           : fixed_point(sample.rendering.deepest.depth * 1e3, 2) + " mm deep");
  ImGui::EndTable();
}

}  // namespace palpate::runner
