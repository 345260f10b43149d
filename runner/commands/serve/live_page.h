#pragma once
// The watchers' page, embedded by the build: live.html with its script, watch/drawing.js and
// live.js.

#include <string_view>

namespace palpate::runner::commands {

std::string_view live_page();

}  // namespace palpate::runner::commands
