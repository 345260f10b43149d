#include "runner/display/console_elements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace palpate::runner::display {
namespace {

using namespace console_colour;

}  // namespace

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

double text_width(const std::string& words) { return ImGui::CalcTextSize(words.c_str()).x; }

const char* fitting(std::initializer_list<const char*> names, float width) {
  const char* last = "";
  for (const char* const name : names) {
    last = name;
    if (text_width(name) <= width - 1.2F * ImGui::GetFontSize()) break;
  }
  return last;
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

}  // namespace palpate::runner::display
