#pragma once

#include <string>
#include <utility>
#include <vector>

// Dear ImGui in a window: context, look, fonts and back ends.

struct GLFWwindow;
struct ImGuiContext;

namespace palpate::runner::display {

/// \param window  its OpenGL context must be current; its owner
///                passes keys, characters, pointer and buttons on
/// \param texts   UTF-8; fonts are loaded for their characters
/// \param scale   of all sizes
ImGuiContext* begin_imgui(GLFWwindow* window, const std::vector<std::string>& texts, float scale);

/// Call it while the window's OpenGL context is current.
void end_imgui(ImGuiContext* context);

/// A font file and the characters to load from it.
struct FontChoice {
  std::string path;
  int face = 0;                        ///< within a collection
  std::vector<unsigned short> ranges;  ///< pairs of first and last character, ended by a 0
};

/// Fonts for the console: one for European scripts, then those for the other characters of `texts`
/// (UTF-8). Empty if fontconfig finds no TrueType font.
std::vector<FontChoice> choose_fonts(const std::vector<std::string>& texts);

}  // namespace palpate::runner::display
