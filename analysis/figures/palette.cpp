#include "analysis/figures/palette.h"

namespace palpate::analysis {

const char* to_string(Role role) {
  constexpr const char* kNames[kRoles] = {"page",   "ink",   "soft",  "grid",    "point",
                                          "ray",    "paper", "heat",  "amber",   "third",
                                          "fourth", "fifth", "sixth", "seventh", "eighth"};
  return kNames[static_cast<std::size_t>(role)];
}

Palette light_palette() {
  return {"#ffffff", "#1f2328", "#59636e", "#e3e6ea", "#0072b2", "#d55e00", "#00795a", "#0072b2",
          "#8a5a00", "#aa3377", "#009e73", "#000000", "#665c00", "#b87a00", "#3a8fc4"};
}

Palette dark_palette() {
  return {"#171b1f", "#e6e9ec", "#a3adb8", "#30373e", "#56b4e9", "#f28b3c", "#2fbf96", "#56b4e9",
          "#f0b84a", "#e08bbf", "#35d0a5", "#ffffff", "#f0e442", "#e69f00", "#b3e0ff"};
}

Palette page_palette() {
  Palette palette;
  for (std::size_t r = 0; r < kRoles; ++r) {
    palette[r] = std::string("var(--") + to_string(static_cast<Role>(r)) + ")";
  }
  return palette;
}

Role line_role(std::size_t line) {
  constexpr std::array kLines{Role::point,   Role::ray,    Role::fourth, Role::third,
                              Role::seventh, Role::eighth, Role::ink,    Role::soft};
  return kLines[line % kLines.size()];
}

}  // namespace palpate::analysis
