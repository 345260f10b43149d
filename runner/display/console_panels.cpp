#include "runner/display/console_panels.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "runner/sample.h"

namespace palpate {
namespace {

const ImVec4 kQuiet{0.60F, 0.64F, 0.69F, 1};
const ImVec4 kBright{0.95F, 0.94F, 0.91F, 1};
const ImVec4 kGood{0.47F, 0.78F, 0.55F, 1};
const ImVec4 kBad{0.97F, 0.46F, 0.40F, 1};
const ImVec4 kButton{0.20F, 0.24F, 0.28F, 1};
const ImVec4 kRed{0.74F, 0.16F, 0.15F, 1};
const ImVec4 kRedLit{0.86F, 0.23F, 0.21F, 1};

void text(const ImVec4& colour, const std::string& words) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextUnformatted(words.c_str(), words.c_str() + words.size());
  ImGui::PopStyleColor();
}

void row(const char* name, const std::string& value, const ImVec4& colour = kBright) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  text(kQuiet, name);
  ImGui::TableNextColumn();
  text(colour, value);
}

std::string number(double value, int digits) {
  std::array<char, 40> out{};
  std::snprintf(out.data(), out.size(), "%.*f", digits, value);  // NOLINT: bounded
  return out.data();
}

bool wide_button(const char* words, float width, bool lit = false) {
  if (lit) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
  const bool pressed = ImGui::Button(words, ImVec2(width, 2.0F * ImGui::GetFontSize()));
  if (lit) ImGui::PopStyleColor();
  return pressed;
}

/// A frame with a name; where to draw in it.
struct Plot {
  ImVec2 from, to;
  ImDrawList* list;
};

Plot plot_frame(const char* name, float width, float height, double top, const char* unit) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float size = ImGui::GetFontSize();
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, {at.x + width, at.y + height}, ImGui::GetColorU32(ImGuiCol_FrameBg), 6);
  list->AddText({at.x + 10, at.y + 6}, ImGui::GetColorU32(kQuiet), name);
  const Plot plot{{at.x + 3.6F * size, at.y + 2.0F * size},
                  {at.x + width - 0.8F * size, at.y + height - 0.8F * size},
                  list};
  for (int i = 0; i <= 2; ++i) {
    const float y = plot.to.y + (plot.from.y - plot.to.y) * static_cast<float>(i) / 2;
    list->AddLine({plot.from.x, y}, {plot.to.x, y}, IM_COL32(255, 255, 255, 26));
    const std::string label = number(top * i / 2, top < 4 ? 1 : 0) + (i == 2 ? unit : "");
    const float wide = ImGui::CalcTextSize(label.c_str()).x;
    list->AddText({plot.from.x - wide - 6, y - size / 2}, ImGui::GetColorU32(kQuiet),
                  label.c_str());
  }
  ImGui::Dummy({width, height});
  return plot;
}

/// 1, 2 or 5 times a power of ten, not below.
double round_up(double value) {
  const double power = std::pow(10, std::floor(std::log10(std::max(value, 1e-3))));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * power) return step * power;
  }
  return 10 * power;
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
  colour(ImGuiCol_ModalWindowDimBg, {0, 0, 0, 0.5F});
  style.ScaleAllSizes(scale);
}

void draw_status(const ConsoleState& state) {
  text(kQuiet,
       state.study + "  ·  " + state.participant + "  ·  session " + std::to_string(state.session));
  ImGui::PushFont(ImGui::GetIO().Fonts->Fonts.back());
  text(kBright, state.state.empty() ? "waiting" : state.state);
  ImGui::PopFont();
  if (!state.stop_plan.empty()) {
    ImGui::SameLine();
    text(kBad, state.stop_plan);
  }
  if (!state.held_by.empty()) {
    ImGui::PushTextWrapPos(0);
    text(kBad, state.held_by);
    ImGui::PopTextWrapPos();
  }
  const float done = state.trials > 0 ? static_cast<float>(std::max(state.trial - 1, 0)) /
                                            static_cast<float>(state.trials)
                                      : 0.0F;
  ImGui::ProgressBar(std::min(done, 1.0F), {-1, 6}, "");
  if (!ImGui::BeginTable("status", 2)) return;
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 7.5F * ImGui::GetFontSize());
  ImGui::TableSetupColumn("value");
  row("Trial", std::to_string(state.trial) + " of " + std::to_string(state.trials));
  row("Block", std::to_string(state.block) + " of " + std::to_string(state.blocks));
  row("Shape", state.shape.empty() ? "-" : state.shape);
  row("Renderer", state.renderer.empty() ? "-" : state.renderer);
  row("Elapsed", in_words(state.elapsed));
  row("Remaining", state.remaining > 0 ? "about " + in_words(state.remaining) : "not known yet");
  ImGui::EndTable();
}

void draw_buttons(const ConsoleState& state, TypedText& reason,
                  std::vector<ConsoleCommand>& asked) {
  using Kind = ConsoleCommand::Kind;
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float half = (ImGui::GetContentRegionAvail().x - gap) / 2;
  const auto button = [&](const char* words, Kind kind, bool lit = false) {
    if (wide_button(words, half, lit)) asked.push_back({kind, {}, 0});
  };
  button("Pause", Kind::pause, state.state == "paused");
  ImGui::SameLine();
  button("Go on", Kind::go_on);
  button("Stop after trial", Kind::stop_after_trial, state.stop_plan == "after this trial");
  ImGui::SameLine();
  button("Stop after block", Kind::stop_after_block, state.stop_plan == "after this block");
  button("Repeat trial", Kind::repeat_trial);
  ImGui::SameLine();
  if (wide_button("End now...", half)) ImGui::OpenPopup("End the session now?");
  ImGui::SetNextWindowPos(ImGui::GetMainViewport()->GetCenter(), ImGuiCond_Appearing, {0.5F, 0.5F});
  if (ImGui::BeginPopupModal("End the session now?", nullptr,
                             ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove)) {
    text(kBright,
         "The trial under way is cut off. All answers are on record;\n"
         "the session can be resumed, unless the participant withdraws.");
    ImGui::SetNextItemWidth(-1);
    ImGui::InputTextWithHint("##why", "Why, for the record", reason.data(), reason.size());
    const auto end = [&](const char* words, const std::string& why) {
      if (!wide_button(words, 1.2F * half)) return;
      asked.push_back({Kind::quit, why, 0});
      reason.fill(0);
      ImGui::CloseCurrentPopup();
    };
    end("End the session", reason.data());
    ImGui::SameLine();
    end("The participant withdraws", "withdrawn");
    ImGui::SameLine();
    if (wide_button("Back", half / 2)) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
  }
}

void draw_emergency(const ConsoleState& state, std::vector<ConsoleCommand>& asked) {
  const bool off = (state.sample.faults & servo_fault::kTripped) != 0;
  const float width = ImGui::GetContentRegionAvail().x;
  ImGui::PushStyleColor(ImGuiCol_Button, kRed);
  ImGui::PushStyleColor(ImGuiCol_ButtonHovered, kRedLit);
  ImGui::PushStyleColor(ImGuiCol_ButtonActive, kRedLit);
  if (ImGui::Button("EMERGENCY: ZERO FORCE   (F12 or Esc)", {width, 3.4F * ImGui::GetFontSize()})) {
    asked.push_back({ConsoleCommand::Kind::emergency_zero, {}, 0});
  }
  ImGui::PopStyleColor(3);
  // Always there, so that no other button moves under the hand when forces go off.
  const float clear = 8 * ImGui::GetFontSize();
  ImGui::BeginChild("forces", {width - clear - ImGui::GetStyle().ItemSpacing.x,
                               2 * ImGui::GetTextLineHeightWithSpacing()});
  ImGui::PushTextWrapPos(0);
  text(off ? kBad : kQuiet,
       off ? "Forces are off: " + fault_words(state.sample.faults) : "No fault");
  ImGui::PopTextWrapPos();
  ImGui::EndChild();
  ImGui::SameLine();
  ImGui::BeginDisabled(!off);
  if (wide_button("Clear the fault", clear))
    asked.push_back({ConsoleCommand::Kind::clear_fault, {}, 0});
  ImGui::EndDisabled();
}

void draw_health(const ConsoleState& state) {
  const Sample& sample = state.sample;
  if (!ImGui::BeginTable("health", 2)) return;
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 7.5F * ImGui::GetFontSize());
  ImGui::TableSetupColumn("value");
  const std::string faults = fault_words(sample.faults);
  row("Servo", faults.empty() ? "sound" : faults, faults.empty() ? kGood : kBad);
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

void draw_forces(const std::deque<ForcePoint>& forces, float width, float height) {
  double most = 1;
  for (const ForcePoint& point : forces) most = std::max(most, point.force);
  const double top = round_up(most);
  const Plot plot = plot_frame("Force on the hand, last 10 s", width, height, top, " N");
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
  const Plot plot = plot_frame("Identification times so far", width, height, top, " s");
  const auto count = static_cast<float>(std::max<std::size_t>(times.size(), 20));
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) continue;
    const float x =
        plot.from.x + (static_cast<float>(i) + 0.5F) / count * (plot.to.x - plot.from.x);
    const float y =
        plot.to.y - static_cast<float>(std::max(times[i], 0.0) / top) * (plot.to.y - plot.from.y);
    plot.list->AddCircleFilled({x, y}, times.size() > 200 ? 2.0F : 3.5F,
                               IM_COL32(116, 170, 217, 255));
  }
}

}  // namespace palpate
