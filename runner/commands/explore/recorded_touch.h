#pragma once

#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/renderer.h"
#include "runner/commands/render/trajectory_csv.h"
#include "runner/display/display.h"

namespace palpate::runner {

/// What a tick of a scene along a recorded path shows. \param state  after it
SceneMoment moment_of(const TimedPose& pose, const protocols::SceneSpec& spec,
                      const rendering::Scene& scene, const rendering::Rendering& rendering,
                      const rendering::RenderState& state);

/// A recorded path, touched in one go. Of a long path at most Timeline::kMost rows are kept,
/// evenly.
class RecordedTouch final : public TouchSource {
 public:
  /// \throws MeshError
  RecordedTouch(std::string scene_path, protocols::SceneSpec spec,
                const rendering::Renderer& renderer, std::vector<TimedPose> poses);

  bool live() const override { return false; }
  void take(std::vector<SceneMoment>& out) override;
  void hold(bool) override {}
  void show(const std::vector<stimuli::ObjectSpec>& objects) override;
  void emergency_zero() noexcept override {}
  void clear_fault() noexcept override {}
  std::string trouble() const override { return trouble_; }

 private:
  void touch();

  std::string scene_path_;
  protocols::SceneSpec spec_;
  const rendering::Renderer& renderer_;
  std::vector<TimedPose> poses_;
  std::vector<SceneMoment> moments_;
  std::string trouble_;
};

}  // namespace palpate::runner
