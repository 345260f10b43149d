#pragma once
// The marks of a figure as Vega draws them, and what they share with its axes. Internal to
// figures_vega.cpp.

#include <nlohmann/json.hpp>
#include <string>

#include "analysis/figures/figures.h"

namespace palpate::analysis::vega {

using Json = nlohmann::ordered_json;

inline constexpr const char* kFont =
    "system-ui, Helvetica Neue, Arial, Liberation Sans, DejaVu Sans, sans-serif";

inline Json signal(const std::string& expression) { return {{"signal", expression}}; }

inline std::string colour_text(Role role) {
  return "palette[" + std::to_string(static_cast<int>(role)) + "]";
}
inline Json colour(Role role) { return signal(colour_text(role)); }

/// Rounded to enough digits for a screen; a page of a big study stays small.
double digits(double value);

/// Vega's name, or a path.
std::string shape_name(Shape shape);

/// The panel's marks with their data, into the panel's group.
void add_marks(Json& group, const Panel& panel);

}  // namespace palpate::analysis::vega
