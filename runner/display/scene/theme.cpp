#include "runner/display/scene/picture.h"

namespace palpate::runner {

const Theme& light_theme() {
  static const Theme theme{.above = {0.87F, 0.90F, 0.93F},
                           .below = {0.97F, 0.97F, 0.965F},
                           .ground = {0.955F, 0.957F, 0.96F},
                           .text = {0.16F, 0.18F, 0.22F},
                           .halo = {1, 1, 1},
                           .ideal_tool = {0.22F, 0.24F, 0.29F},
                           .virtual_tool = {0.95F, 0.52F, 0.13F},
                           .grip = {0.36F, 0.38F, 0.43F},
                           .force = {0.86F, 0.16F, 0.16F},
                           .torque = {0.48F, 0.20F, 0.72F},
                           .contact = {0.93F, 0.12F, 0.20F}};
  return theme;
}

const Theme& dark_theme() {
  static const Theme theme{.above = {0.085F, 0.098F, 0.115F},
                           .below = {0.13F, 0.15F, 0.175F},
                           .ground = {0.15F, 0.17F, 0.195F},
                           .text = {0.90F, 0.91F, 0.92F},
                           .halo = {0.06F, 0.07F, 0.08F},
                           .ideal_tool = {0.93F, 0.91F, 0.87F},
                           .virtual_tool = {0.95F, 0.55F, 0.25F},
                           .grip = {0.60F, 0.62F, 0.66F},
                           .force = {0.97F, 0.78F, 0.26F},
                           .torque = {0.72F, 0.52F, 0.95F},
                           .contact = {0.95F, 0.35F, 0.30F}};
  return theme;
}

}  // namespace palpate::runner
