#pragma once
// The view of a stimulus beside touch: the drawn scene at a moment, as plain
// values. Virtual frame, m, unless noted.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "protocols/sight.h"
#include "rendering/tool.h"
#include "runner/display/display.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/servo/sample.h"
#include "runner/workspace_map.h"

namespace palpate::runner::display {

/// An interval of a trial in which something is seen.
struct SeenTrial {
  protocols::ViewSpec view;
  protocols::SeenSpec seen;
  stimuli::ObjectSpec object;  ///< as it is felt, or the shape seen instead, placed in the world
  rendering::Tool tool;
  WorkspaceMap workspace;
  std::uint64_t seed = 0;  ///< of the noise
};

/// The screen of the station and an eye. \param right  m, device frame, of the eye from midway
/// between both
PictureWindow window_of(const SeenTrial& trial, double right = 0);

/// The part of a tick that a frame needs.
struct SeenMoment {
  std::int64_t time_ns = 0;  ///< session clock
  rendering::LineProbe hand, ideal;
  Vec3 normal{0, 0, 1}, contact{0};  ///< of the deepest contact, out of the object
  double pressing = 0;               ///< N, along the normal
  double depth = 0;                  ///< m, of the deepest contact
  bool forces = false, touching = false, touched = false;  ///< touched: since forces are on
};
/// \param before  the moment before, or none in this interval yet
SeenMoment moment_of(const servo::Sample& sample, const SeenMoment* before);

/// The moments of the last second and a little, from the session's thread to the display's.
class SeenTrail {
 public:
  void add(const SeenMoment& moment);
  void clear();
  /// Linear between ticks; the oldest or the newest beyond them. None: there are none.
  std::optional<SeenMoment> at(std::int64_t time_ns) const;
  std::optional<SeenMoment> newest() const;

 private:
  static constexpr std::int64_t kKept_ns = 1'100'000'000;
  mutable std::mutex mutex_;
  std::deque<SeenMoment> moments_;
};

/// Whether it is seen at a moment.
bool is_visible(const protocols::SeenSpec& seen, const SeenMoment& moment);

/// The displacement of the drawn object by noise: piecewise constant. m, world
Vec3 noise_at(const SeenTrial& trial, std::int64_t time_ns);

/// The tool as drawn.
DrawnTool drawn_tool(const SeenTrial& trial, const SeenMoment& moment);

/// The pose at which the object is drawn.
Pose drawn_pose(const SeenTrial& trial, std::int64_t time_ns);

/// Draws one interval after another. Belongs to the display's thread.
class SeenScene {
 public:
  /// \throws MeshError, std::runtime_error: the object cannot be drawn
  explicit SeenScene(std::shared_ptr<const SeenTrial> trial);

  const SeenTrial& trial() const { return *trial_; }
  /// \param time_ns  session clock, of the frame
  ScenePicture picture(const SeenMoment& moment, std::int64_t time_ns) const;
  Theme theme() const;
  /// The rectangle of a picture file: its centre and half of its width and height, as a share of
  /// the screen's width and height, from the upper left corner.
  struct Place {
    double x = 0, y = 0, half_width = 0, half_height = 0;
  };
  Place picture_place(std::int64_t time_ns) const;

 private:
  std::shared_ptr<const DrawnMesh> dented(const SeenMoment& moment, const Pose& pose) const;

  std::shared_ptr<const SeenTrial> trial_;
  std::shared_ptr<const DrawnMesh> mesh_;
  double size_ = 0.05;  ///< m, radius about the object's origin
};

/// Luminance, 0 to 1, linear, as a grey of sRGB.
float grey_of(double luminance);

}  // namespace palpate::runner::display
