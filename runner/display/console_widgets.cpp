#include "runner/display/console_widgets.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "runner/display/fonts.h"

namespace palpate::runner {
namespace {

constexpr float kFontSize = 16, kTitleFontSize = 28;  // px at scale 1

/// \param choices  must outlive the atlas' building, which reads the ranges
void add_font(ImFontAtlas& atlas, const std::vector<FontChoice>& choices, float size) {
  ImFontConfig config;
  for (const FontChoice& choice : choices) {
    config.FontNo = choice.face;
    atlas.AddFontFromFileTTF(choice.path.c_str(), size, &config, choice.ranges.data());
    config.MergeMode = true;
  }
  if (!config.MergeMode) {
    config.SizePixels = size;
    atlas.AddFontDefault(&config);
  }
}

}  // namespace

using namespace console_colour;

void load_console_fonts(const std::vector<std::string>& texts, float scale) {
  const std::vector<FontChoice> choices = choose_fonts(texts);
  ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  add_font(atlas, choices, kFontSize * scale);
  add_font(atlas, choices, kTitleFontSize * scale);
  atlas.Build();
}

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

void coloured_text(const ImVec4& colour, const std::string& words) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextUnformatted(words.c_str(), words.c_str() + words.size());
  ImGui::PopStyleColor();
}

void table_row(const char* name, const std::string& value, const ImVec4& colour) {
  ImGui::TableNextColumn();  // a new row where the last one is full
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

}  // namespace palpate::runner
