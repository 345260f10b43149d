#include "runner/display/fonts.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <fontconfig/fontconfig.h>
#include <glib.h>
#include <imgui.h>

#include <algorithm>
#include <memory>
#include <set>

#include "runner/display/console_elements.h"

namespace palpate::runner::display {
namespace {

constexpr float kFontSize = 16, kTitleFontSize = 28;  // px at scale 1

/// \param choices  must outlive the building of the atlas, which reads the ranges
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

/// The first font is for text, the last for titles.
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

template <auto destroy>
struct With {
  template <class T>
  void operator()(T* what) const {
    destroy(what);
  }
};
using Pattern = std::unique_ptr<FcPattern, With<FcPatternDestroy>>;
using FontSet = std::unique_ptr<FcFontSet, With<FcFontSetDestroy>>;

// Latin with all accents, Greek, Cyrillic, dashes and quotation marks, arrows.
constexpr unsigned short kEuropean[] = {0x0020, 0x024f, 0x0370, 0x052f, 0x1e00, 0x1fff, 0x2000,
                                        0x206f, 0x2190, 0x21ff, 0x2200, 0x22ff, 0};

bool european(unsigned letter) {
  for (const unsigned short* at = kEuropean; *at != 0; at += 2) {
    if (letter >= at[0] && letter <= at[1]) return true;
  }
  return false;
}

/// The characters that are not European. The console draws 16-bit characters only, left to right.
std::set<unsigned> letters_of(const std::vector<std::string>& texts) {
  std::set<unsigned> letters;
  for (const std::string& text : texts) {
    char* const valid = g_utf8_make_valid(text.data(), static_cast<gssize>(text.size()));
    for (const char* at = valid; *at != 0; at = g_utf8_next_char(at)) {
      const gunichar letter = g_utf8_get_char(at);
      if (letter < 0x10000 && g_unichar_isgraph(letter) && !european(letter))
        letters.insert(letter);
    }
    g_free(valid);
  }
  return letters;
}

FontSet installed() {
  const Pattern wanted(FcNameParse(reinterpret_cast<const FcChar8*>("Noto Sans,DejaVu Sans,Sans")));
  FcConfigSubstitute(nullptr, wanted.get(), FcMatchPattern);
  FcDefaultSubstitute(wanted.get());
  FcResult result = FcResultMatch;
  return FontSet(FcFontSort(nullptr, wanted.get(), FcFalse, nullptr, &result));
}

bool readable(FcPattern* font, FontChoice& choice) {
  FcChar8* text = nullptr;
  if (FcPatternGetString(font, FC_FONTFORMAT, 0, &text) != FcResultMatch ||
      std::string(reinterpret_cast<const char*>(text)) != "TrueType") {
    return false;
  }
  FcBool outline = FcFalse;
  if (FcPatternGetBool(font, FC_OUTLINE, 0, &outline) != FcResultMatch || outline == FcFalse) {
    return false;
  }
  if (FcPatternGetString(font, FC_FILE, 0, &text) != FcResultMatch) return false;
  choice.path = reinterpret_cast<const char*>(text);
  int index = 0;
  FcPatternGetInteger(font, FC_INDEX, 0, &index);
  choice.face = index & 0xffff;  // the upper bits are the instance of a variable font
  return g_file_test(choice.path.c_str(), G_FILE_TEST_IS_REGULAR) != 0;
}

/// Moves the characters that the font has from `letters` into ranges.
std::vector<unsigned short> take(FcPattern* font, std::set<unsigned>& letters) {
  std::vector<unsigned short> ranges;
  FcCharSet* has = nullptr;
  if (FcPatternGetCharSet(font, FC_CHARSET, 0, &has) != FcResultMatch) return ranges;
  for (auto at = letters.begin(); at != letters.end();) {
    if (FcCharSetHasChar(has, *at) == FcFalse) {
      ++at;
      continue;
    }
    const auto letter = static_cast<unsigned short>(*at);
    ranges.insert(ranges.end(), {letter, letter});
    at = letters.erase(at);
  }
  if (!ranges.empty()) ranges.push_back(0);
  return ranges;
}

}  // namespace

ImGuiContext* begin_imgui(GLFWwindow* window, const std::vector<std::string>& texts, float scale) {
  ImGuiContext* const context = ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // write no file
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

std::vector<FontChoice> choose_fonts(const std::vector<std::string>& texts) {
  std::vector<FontChoice> choices;
  const FontSet fonts = installed();
  if (fonts == nullptr) return choices;
  std::set<unsigned> letters = letters_of(texts);
  for (int i = 0; i < fonts->nfont; ++i) {
    FcPattern* const font = fonts->fonts[i];
    FontChoice choice;
    if (!readable(font, choice)) continue;
    if (choices.empty()) {
      choice.ranges.assign(std::begin(kEuropean), std::end(kEuropean));
      choices.push_back(choice);
    }
    choice.ranges = take(font, letters);
    if (!choice.ranges.empty()) choices.push_back(std::move(choice));
    if (letters.empty()) break;
  }
  return choices;
}

}  // namespace palpate::runner::display
