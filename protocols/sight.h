#pragma once
// Sight beside touch, as plain values. Meaning and default of each key:
// protocol.v2.schema.json. SI units.

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::protocols {

enum class Stereo { none, side_by_side, top_bottom, anaglyph, quad_buffer };
enum class Mirror { none, horizontal, vertical };
enum class PatchPlace { none, lower_left, lower_right, upper_left, upper_right };

/// The geometry of the station: the picture and the eyes, in the device's frame, m.
struct ViewSpec {
  Vec3 lower_left{0}, lower_right{0}, upper_left{0};  ///< corners of the picture
  Vec3 eye{0};                                        ///< midway between the eyes
  double ipd = 0.063;                                 ///< m, between the eyes
  Stereo stereo = Stereo::none;
  Mirror mirror = Mirror::none;         ///< the picture is seen in a mirror
  double background = 0.2, light = 1;   ///< luminance, 0 to 1, linear
  PatchPlace patch = PatchPlace::none;  ///< a square for a photodiode
  bool lag_accepted = false;            ///< a lag that people may notice does not refuse a session
};

/// The look of a stimulus: congruent with touch, or changed by a stated amount.
struct SeenSpec {
  enum class When { forces, contact, before, always };
  bool object = false, tool = false, picture = false;
  When when = When::forces;
  double size_ratio = 1;                 ///< of the drawn object about its centre
  Vec3 offset{0};                        ///< m, of the drawn object, world
  double turn_deg = 0;                   ///< of the drawn object
  Vec3 axis{0, 0, 1};                    ///< of the turn, unit, world
  Vec3 tool_offset{0};                   ///< m
  double tool_gain = 1;                  ///< control/display ratio about the home centre
  bool tool_stops = true;                ///< the drawn tool stops at the surface
  bool gives_as_felt = false;            ///< the drawn surface gives way by the felt depth
  std::optional<double> give_stiffness;  ///< N/m, of the drawn indentation; none: the felt depth
  double delay = 0;                      ///< s
  double blur_deg = 0;                   ///< sd, degrees of visual angle
  double noise = 0, noise_hz = 10;       ///< m, sd of a random offset; its changes a second
  std::string file_name;                 ///< of the picture; "": none
  std::shared_ptr<const std::string> file_bytes;     ///< PNG
  std::shared_ptr<const stimuli::ObjectSpec> shape;  ///< seen instead of the felt one; null: that

  bool anything() const { return object || tool || picture; }
};

/// The blocks of a study of cues, and the number by which the seen differs from the felt.
struct CuesSpec {
  std::string haptic, visual;     ///< names of blocks
  std::vector<std::string> both;  ///< likewise
  std::string conflict;           ///< JSON pointer into the standard
};

}  // namespace palpate::protocols
