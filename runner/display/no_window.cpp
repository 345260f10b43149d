#include "runner/display/explore_window.h"
#include "runner/display/scene/painter.h"
#include "runner/display/scene/picture.h"
#include "runner/display/window.h"

namespace palpate::runner::display {
namespace {

constexpr const char* kNotBuiltIn = "this palpate was built without windows and pictures";

}  // namespace

std::unique_ptr<DisplayLoop> make_windows(const WindowSettings&) {
  throw DisplayError(kNotBuiltIn);
}

std::string missing_letters(const std::vector<std::string>&) { return {}; }

void explore_in_window(ExploreSettings, TouchSource&) { throw DisplayError(kNotBuiltIn); }

std::unique_ptr<ScenePainter> make_painter(int, int) { throw DisplayError(kNotBuiltIn); }

}  // namespace palpate::runner::display
