#include <imgui.h>

#include <algorithm>

#include "runner/display/console_panels.h"
#include "runner/display/console_widgets.h"

namespace palpate::runner {

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

}  // namespace palpate::runner
