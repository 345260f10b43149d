#pragma once
// Colours and small elements of windows, in Dear ImGui.

#include <imgui.h>

#include <initializer_list>
#include <string>

namespace palpate::runner::display {

namespace console_colour {
inline const ImVec4 kQuiet{0.60F, 0.64F, 0.69F, 1};
inline const ImVec4 kBright{0.95F, 0.94F, 0.91F, 1};
inline const ImVec4 kGood{0.47F, 0.78F, 0.55F, 1};
inline const ImVec4 kBad{0.97F, 0.46F, 0.40F, 1};
inline const ImVec4 kButton{0.20F, 0.24F, 0.28F, 1};
inline const ImVec4 kDue{0.16F, 0.42F, 0.27F, 1};
inline const ImVec4 kRed{0.74F, 0.16F, 0.15F, 1};
inline const ImVec4 kRedLit{0.86F, 0.23F, 0.21F, 1};
}  // namespace console_colour

void coloured_text(const ImVec4& colour, const std::string& words);
/// Breaks lines at spaces only: Dear ImGui would break "0.5" apart.
void wrapped_text(const ImVec4& colour, const std::string& words);
/// Name and value in the next two cells of a table.
void table_row(const char* name, const std::string& value,
               const ImVec4& colour = console_colour::kBright);

enum class Look { plain, lit, due };  ///< due: the button to press next
bool wide_button(const char* words, float width, Look look = Look::plain);

struct SliderRange {
  float least, most;  ///< logarithmic where least > 0
  int digits;         ///< after the decimal point; the value is rounded to them
  const char* unit;   ///< with a space before it
};
/// Name and value are drawn beside the slider: inside, the handle would hide the value. \return
/// whether it was moved
bool slider(const char* name, float& value, const SliderRange& range);

std::string fixed_point(double value, int digits);

/// Modifier keys held down in either window.
struct Modifiers {
  bool ctrl = false, shift = false;
};

/// The emergency button along the upper edge of the window, over everything else. Only drawn: the
/// window handles its clicks. \return its lower edge, px
float draw_emergency(bool lit);

double text_width(const std::string& words);  ///< px
/// The first name that fits the width (px), else the last.
const char* fitting(std::initializer_list<const char*> names, float width);

}  // namespace palpate::runner::display
