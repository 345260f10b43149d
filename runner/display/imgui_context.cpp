#include "runner/display/imgui_context.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include "runner/display/console_widgets.h"
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

/// The first font is the usual one, the last that of titles.
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
  colour(ImGuiCol_Button, console_colour::kButton);
  colour(ImGuiCol_ButtonHovered, {0.26F, 0.31F, 0.36F, 1});
  colour(ImGuiCol_ButtonActive, {0.31F, 0.43F, 0.55F, 1});
  colour(ImGuiCol_PlotHistogram, {0.38F, 0.58F, 0.76F, 1});
  colour(ImGuiCol_Text, console_colour::kBright);
  colour(ImGuiCol_TextDisabled, console_colour::kQuiet);
  colour(ImGuiCol_ModalWindowDimBg, {0, 0, 0, 0.5F});
  style.ScaleAllSizes(scale);
}

}  // namespace

ImGuiContext* begin_imgui(GLFWwindow* window, const std::vector<std::string>& texts, float scale) {
  ImGuiContext* const context = ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // writes no file
  load_console_fonts(texts, scale);
  style_console(scale);
  glfwSetWindowFocusCallback(window, &ImGui_ImplGlfw_WindowFocusCallback);
  glfwSetCursorEnterCallback(window, &ImGui_ImplGlfw_CursorEnterCallback);
  glfwSetScrollCallback(window, &ImGui_ImplGlfw_ScrollCallback);
  ImGui_ImplGlfw_InitForOpenGL(window, false);
  ImGui_ImplOpenGL3_Init("#version 330 core");
  return context;
}

void end_imgui(ImGuiContext* context) {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext(context);
}

}  // namespace palpate::runner
