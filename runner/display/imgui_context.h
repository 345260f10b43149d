#pragma once
// Dear ImGui in a window: context, look, fonts and back ends.

#include <string>
#include <vector>

struct GLFWwindow;
struct ImGuiContext;

namespace palpate::runner {

/// \param window  whose OpenGL context is current; its keys, characters, pointer and buttons are
/// its
///                owner's to pass on
/// \param texts   UTF-8, whose characters are needed
/// \param scale   of sizes
ImGuiContext* begin_imgui(GLFWwindow* window, const std::vector<std::string>& texts, float scale);

/// While the window's OpenGL context is current.
void end_imgui(ImGuiContext* context);

}  // namespace palpate::runner
