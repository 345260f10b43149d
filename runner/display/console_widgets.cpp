#include "runner/display/console_widgets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace palpate::runner {

using namespace console_colour;

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

bool slider(const char* name, float& value, const SliderRange& range) {
  // Behind ### stands what identifies it, as the words change.
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

}  // namespace palpate::runner
