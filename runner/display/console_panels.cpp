#include "runner/display/console_panels.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "runner/display/console_words.h"
#include "runner/safety/fault_table.h"

namespace palpate::runner {
namespace {

const ImVec4 kQuiet{0.60F, 0.64F, 0.69F, 1};
const ImVec4 kBright{0.95F, 0.94F, 0.91F, 1};
const ImVec4 kGood{0.47F, 0.78F, 0.55F, 1};
const ImVec4 kBad{0.97F, 0.46F, 0.40F, 1};
const ImVec4 kButton{0.20F, 0.24F, 0.28F, 1};
const ImVec4 kDue{0.16F, 0.42F, 0.27F, 1};
const ImVec4 kRed{0.74F, 0.16F, 0.15F, 1};
const ImVec4 kRedLit{0.86F, 0.23F, 0.21F, 1};

void text(const ImVec4& colour, const std::string& words) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextUnformatted(words.c_str(), words.c_str() + words.size());
  ImGui::PopStyleColor();
}

void row(const char* name, const std::string& value, const ImVec4& colour = kBright) {
  ImGui::TableNextColumn();  // a new row where the last one is full
  text(kQuiet, name);
  ImGui::TableNextColumn();
  text(colour, value);
}

std::string number(double value, int digits) {
  std::array<char, 40> out{};
  std::snprintf(out.data(), out.size(), "%.*f", digits, value);  // NOLINT: bounded
  return out.data();
}

enum class Look { plain, lit, due };  ///< due: what to press next

bool wide_button(const char* words, float width, Look look = Look::plain) {
  if (look != Look::plain) {
    ImGui::PushStyleColor(ImGuiCol_Button, look == Look::due
                                               ? kDue
                                               : ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
  }
  const bool pressed = ImGui::Button(words, ImVec2(width, 2.0F * ImGui::GetFontSize()));
  if (look != Look::plain) ImGui::PopStyleColor();
  return pressed;
}

bool off(const ConsoleState& state) { return (state.sample.faults & servo_fault::kTripped) != 0; }

const char* word(ConsoleCommand::Kind kind) {
  return kind == ConsoleCommand::Kind::go_on          ? "Go on"
         : kind == ConsoleCommand::Kind::repeat_trial ? "Repeat"
                                                      : "End";
}

}  // namespace

void style_console(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.WindowBorderSize = 0;
  style.ChildBorderSize = 0;
  style.FrameRounding = style.ChildRounding = style.PopupRounding = style.GrabRounding = 6;
  style.WindowPadding = {14, 12};
  style.FramePadding = {10, 6};
  style.ItemSpacing = {10, 8};
  style.CellPadding = {6, 2};
  const auto colour = [&](ImGuiCol which, ImVec4 value) { style.Colors[which] = value; };
  colour(ImGuiCol_WindowBg, {0.118F, 0.137F, 0.161F, 1});
  colour(ImGuiCol_ChildBg, {0, 0, 0, 0});
  colour(ImGuiCol_PopupBg, {0.15F, 0.17F, 0.20F, 1});
  colour(ImGuiCol_FrameBg, {0.098F, 0.114F, 0.133F, 1});
  colour(ImGuiCol_FrameBgHovered, {0.13F, 0.15F, 0.17F, 1});
  colour(ImGuiCol_FrameBgActive, {0.13F, 0.15F, 0.17F, 1});
  colour(ImGuiCol_Button, kButton);
  colour(ImGuiCol_ButtonHovered, {0.26F, 0.31F, 0.36F, 1});
  colour(ImGuiCol_ButtonActive, {0.31F, 0.43F, 0.55F, 1});
  colour(ImGuiCol_PlotHistogram, {0.38F, 0.58F, 0.76F, 1});
  colour(ImGuiCol_Text, kBright);
  colour(ImGuiCol_TextDisabled, kQuiet);
  colour(ImGuiCol_ModalWindowDimBg, {0, 0, 0, 0.5F});
  style.ScaleAllSizes(scale);
}

namespace {

void progress(const ConsoleState& state) {
  ImGui::ProgressBar(static_cast<float>(share_done(state)), {-1, 6}, "");
}

void title(const ConsoleState& state) {
  const float font = ImGui::GetFontSize();
  ImGui::PushFont(ImGui::GetIO().Fonts->Fonts.back());
  text(state.state == "fault" ? kBad : kBright, state_title(state));
  ImGui::PopFont();
  const ImVec2 corner = ImGui::GetItemRectMax();
  ImGui::GetWindowDrawList()->AddText(
      {corner.x + ImGui::GetStyle().ItemSpacing.x, corner.y - 1.35F * font},
      ImGui::GetColorU32(state.stop_plan.empty() ? kBright : kBad), beside_state(state).c_str());
}

std::string of(int number, int all) {
  return all > 0 ? std::to_string(number) + " of " + std::to_string(all) : "-";
}

}  // namespace

void draw_status(const ConsoleState& state, bool hidden, bool beside) {
  if (beside && !state.checklist.steps.empty()) return;  // no trial yet: the room is needed
  text(kQuiet,
       state.study + "  ·  " + state.participant + "  ·  session " + std::to_string(state.session));
  title(state);
  progress(state);
  if (!ImGui::BeginTable("status", beside ? 4 : 2)) return;
  for (int i = 0; i < (beside ? 2 : 1); ++i) {
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed,
                            (beside ? 6.0F : 7.5F) * ImGui::GetFontSize());
    ImGui::TableSetupColumn("value");
  }
  const bool practice = state.practice && (state.state == "trial" || state.state == "homing");
  row("Trial", of(state.trial, state.trials) + (practice ? "  PRACTICE" : ""),
      practice ? kGood : kBright);
  row("Block", of(state.block, state.blocks));
  row("Shape", state.shape.empty() ? "-" : hidden ? "hidden" : state.shape);
  row("Renderer", state.renderer.empty() ? "-" : state.renderer);
  row("Last answer", state.answer.empty() ? "-" : hidden ? "hidden" : state.answer);
  row("Elapsed", in_words(state.elapsed));
  row("Remaining", state.remaining > 0 ? "about " + in_words(state.remaining) : "not known yet");
  ImGui::EndTable();
}

namespace {

using Kind = ConsoleCommand::Kind;

void draw_ending(Ending& ending, float half, std::vector<ConsoleCommand>& asked) {
  if (!std::exchange(ending.seen, true)) ImGui::SetScrollHereY(0);  // in a small window
  ImGui::PushTextWrapPos(0);
  text(kBright,
       "End the session now? The trial under way is cut off. All answers are on record; "
       "the session can be resumed, unless the participant withdraws.");
  ImGui::PopTextWrapPos();
  ImGui::SetNextItemWidth(-1);
  ImGui::InputTextWithHint("##why", "Why, for the record", ending.reason.data(),
                           ending.reason.size());
  const auto end = [&](const char* words, const std::string& why) {
    if (!wide_button(words, half)) return;
    asked.push_back({Kind::quit, why, 0});
    ending = {};
  };
  end("End the session", ending.reason.data());
  ImGui::SameLine();
  if (wide_button("Back", half)) ending = {};
  end("Participant withdraws", "withdrawn");
}

}  // namespace

void draw_buttons(const ConsoleState& state, bool beside, Ending& ending,
                  std::vector<ConsoleCommand>& asked) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float half = (ImGui::GetContentRegionAvail().x - gap) / 2;
  if (ending.asked) {
    draw_ending(ending, half, asked);
    return;
  }
  if (beside && !state.checklist.steps.empty()) {
    if (wide_button("End now...", half)) ending.asked = true;
    return;
  }
  const auto button = [&](const char* words, Kind kind, bool lit = false, bool due = false) {
    const Look look = due ? Look::due : lit ? Look::lit : Look::plain;
    if (wide_button(words, half, look)) asked.push_back({kind, {}, 0});
  };
  button("Pause", Kind::pause, state.state == "paused");
  ImGui::SameLine();
  button("Go on", Kind::go_on, false, !state.held_by.empty() && !off(state));
  button("Stop after trial", Kind::stop_after_trial, state.stop_plan == "after this trial");
  ImGui::SameLine();
  button("Stop after block", Kind::stop_after_block, state.stop_plan == "after this block");
  button("Repeat trial", Kind::repeat_trial);
  ImGui::SameLine();
  if (wide_button("End now...", half)) ending.asked = true;
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
                     std::vector<ConsoleCommand>& asked) {
  // Always there, so that no other button moves under the hand when forces go off.
  const float font = ImGui::GetFontSize(), room = ImGui::GetContentRegionAvail().x;
  const float clear = 8 * font, gap = ImGui::GetStyle().ItemSpacing.x;
  const float wide = (room - clear) / font;
  const float lines = wide < 18 ? 6.25F : wide < 24 ? 4.25F : 3.25F;
  ImGui::BeginChild("forces", {room - clear - gap, lines * font});
  ImGui::PushTextWrapPos(0);
  if (silence > 0) {
    text(kBad, "No news from the session for " + in_words(silence));
  } else {
    const bool alarm = off(state) && !not_on_yet(state);
    text(alarm ? kBad : state.held_by.empty() ? kQuiet : kBright, words_of_forces(state));
  }
  ImGui::PopTextWrapPos();
  ImGui::EndChild();
  ImGui::SameLine();
  ImGui::BeginDisabled(!off(state));
  const Look look = off(state) && !not_on_yet(state) ? Look::due : Look::plain;
  if (wide_button("Clear the fault", clear, look)) asked.push_back({Kind::clear_fault, {}, 0});
  ImGui::EndDisabled();
}

namespace {

/// Broken at spaces only: Dear ImGui would tear "0.5" apart.
void wrapped_text(const ImVec4& colour, const std::string& words) {
  const float room = ImGui::GetContentRegionAvail().x;
  std::string line;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    const std::string longer = line + (line.empty() ? "" : " ") + words.substr(at, end - at);
    if (!line.empty() && ImGui::CalcTextSize(longer.c_str()).x > room) {
      text(colour, line);
      line = words.substr(at, end - at);
    } else {
      line = longer;
    }
    at = end + 1;
  }
  text(colour, line);
}

const char* word(Checklist::Step::State state) {
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

void draw_choices(const Checklist& list, Ending& ending, std::vector<ConsoleCommand>& asked) {
  const float font = ImGui::GetFontSize(), gap = ImGui::GetStyle().ItemSpacing.x;
  const float room = ImGui::GetContentRegionAvail().x;
  float right = 0;
  for (const auto& [kind, meaning] : list.choices) {
    const std::string words = std::string(word(kind)) + ": " + meaning;
    const float width = std::max(10 * font, ImGui::CalcTextSize(words.c_str()).x + 2 * font);
    if (right > 0 && right + gap + width < room) {
      ImGui::SameLine();
      right += gap + width;
    } else {
      right = width;
    }
    if (!ImGui::Button(words.c_str(), {width, 2.4F * font})) continue;
    if (kind == Kind::quit) {
      ending.asked = true;
    } else {
      asked.push_back({kind, {}, 0});
    }
  }
}

}  // namespace

void draw_checklist(const Checklist& list, Ending& ending, std::vector<ConsoleCommand>& asked) {
  using State = Checklist::Step::State;
  const float font = ImGui::GetFontSize();
  std::size_t due = 0;
  while (due < list.steps.size() && list.steps[due].state != State::now) ++due;
  text(kQuiet, "Before the first trial: step " +
                   std::to_string(std::min(due + 1, list.steps.size())) + " of " +
                   std::to_string(list.steps.size()));
  ImGui::PushFont(ImGui::GetIO().Fonts->Fonts.back());
  std::string instruction = list.instruction;
  if (!instruction.empty() && instruction[0] >= 'a' && instruction[0] <= 'z') instruction[0] -= 32;
  wrapped_text(kBright, instruction);
  ImGui::PopFont();
  draw_choices(list, ending, asked);
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
      text(step.state == State::done ? kGood : now ? kBright : kQuiet, word(step.state));
      ImGui::TableNextColumn();
      text(now ? kBright : kQuiet, step.words);
    }
    ImGui::EndTable();
  }
  ImGui::PopFont();
}

void draw_health(const ConsoleState& state, bool brief) {
  const Sample& sample = state.sample;
  if (!ImGui::BeginTable("health", 2)) return;
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 7.5F * ImGui::GetFontSize());
  ImGui::TableSetupColumn("value");
  const std::string faults = fault_words(sample.faults);
  row("Servo", faults.empty() ? "sound" : faults,
      faults.empty()      ? kGood
      : not_on_yet(state) ? kQuiet
                          : kBad);
  if (brief) {
    ImGui::EndTable();
    return;
  }
  row("Period", number(static_cast<double>(sample.period_ns) * 1e-6, 3) + " ms, longest " +
                    number(static_cast<double>(state.longest_period_ns) * 1e-6, 2) + " ms");
  row("Computing", number(static_cast<double>(sample.compute_ns) * 1e-3, 1) + " µs");
  row("Missed",
      std::to_string(state.missed_ticks) + " of " + std::to_string(state.ticks) + " ticks",
      state.missed_ticks == 0 ? kBright : kBad);
  row("Force", number(glm::length(sample.device1), 2) + " N at the tip, " +
                   number(glm::length(sample.device2), 2) + " N at the tail");
  row("Contact", sample.rendering.contacts == 0
                     ? "none"
                     : number(sample.rendering.deepest.depth * 1e3, 2) + " mm deep");
  ImGui::EndTable();
}

}  // namespace palpate::runner
