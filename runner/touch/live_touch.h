#pragma once
// A scene touched by a hand through a device or along a recorded path, and the window of `palpate
// explore`.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "protocols/parse.h"
#include "rendering/renderer.h"
#include "runner/display/display.h"
#include "runner/servo/servo_thread.h"
#include "runner/session/markers.h"
#include "runner/session/sample_stream.h"
#include "runner/station/run_settings.h"
#include "runner/touch/forces.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::touch {

/// The moment of a scene at a tick along a recorded path. \param state  after the tick
display::SceneMoment moment_of(const touch::TimedPose& pose, const protocols::SceneSpec& spec,
                               const rendering::Scene& scene, const rendering::Rendering& rendering,
                               const rendering::RenderState& state);

/// A recorded path, rendered at once. Of a long path at most Timeline::kMost rows are kept, evenly
/// spaced.
class RecordedTouch final : public display::TouchSource {
 public:
  /// \throws MeshError
  RecordedTouch(std::string scene_path, protocols::SceneSpec spec,
                const rendering::Renderer& renderer, std::vector<touch::TimedPose> poses);

  bool live() const override { return false; }
  void take(std::vector<display::SceneMoment>& out) override;
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
  std::vector<touch::TimedPose> poses_;
  std::vector<display::SceneMoment> moments_;
  std::string trouble_;
};

/// Of the window of `palpate explore`.
struct HandsOnSettings {
  std::string scene_path, trajectory;  ///< trajectory: recorded path; empty: a device's
  std::string pictures;                ///< folder for those that are kept; empty: none
  bool labels = false;
  station::RunSettings run;  ///< the device, and other recorders
};

/// Touches the scene in a window until that is closed. \return exit status
/// \throws UsageError, DisplayError, InputError, MeshError; std::runtime_error: no such device
int explore_hands_on(const protocols::SceneSpec& spec, const rendering::Renderer& renderer,
                     const HandsOnSettings& settings);

/// A scene touched through a device. The servo has a thread of its own, which waits only for the
/// clock and the device. A second thread empties the servo's ring and keeps the samples for the
/// display, so a stalled display loses nothing of the last minute; it also compiles scenes.
class LiveTouch final : public display::TouchSource {
 public:
  struct Settings {
    std::string scene_path;  ///< named in faults
    protocols::SceneSpec spec;
    const rendering::Renderer* renderer = nullptr;
    servo::ServoSettings servo;
    /// Called with the objects before they are shown: limits them to the device.
    std::function<void(std::vector<stimuli::ObjectSpec>&)> limit;
    /// Called by emergency_zero() beside the servo's own, such as a guard's; may be empty.
    std::function<void()> emergency;
    session::Markers* markers = nullptr;      ///< each scene is a trial; null: none
    session::SampleStream* stream = nullptr;  ///< null: none
  };

  /// \param device, clock  the servo's alone; must outlive this. \throws MeshError
  LiveTouch(servo::Device& device, servo::Clock& clock, Settings settings);
  ~LiveTouch() override;  ///< zero force
  LiveTouch(const LiveTouch&) = delete;
  LiveTouch& operator=(const LiveTouch&) = delete;

  bool live() const override { return true; }
  void take(std::vector<display::SceneMoment>& out) override;
  void hold(bool held) override { held_.store(held); }
  void step(int ticks) override { steps_.fetch_add(ticks); }
  double away() const override { return servo_.away(); }
  void show(const std::vector<stimuli::ObjectSpec>& objects) override;
  void pull(const rendering::BodyPull& by) noexcept override { servo_.pull(by); }
  void emergency_zero() noexcept override;
  void clear_fault() noexcept override { servo_.clear_fault(); }
  std::string trouble() const override;

  /// Samples kept so far, taken or not. From any thread.
  std::uint64_t recorded() const noexcept { return recorded_.load(); }
  servo::ServoThread& servo() { return servo_; }  ///< for signal handlers

 private:
  void record(const std::stop_token& stop);
  void stop_or_continue(std::optional<std::vector<stimuli::ObjectSpec>> wanted);
  void keep_what_is_there();
  void report_trouble(const std::string& trouble);
  void inform_recorders(const servo::Sample& sample);
  protocols::SceneSpec with_objects(const std::vector<stimuli::ObjectSpec>& objects) const;
  void prepare(const std::vector<stimuli::ObjectSpec>& objects);
  std::int64_t period_ns() const;
  void keep(const servo::Sample& sample, std::span<const rendering::BodyPose> bodies);
  void add_contacts(display::SceneMoment& moment);
  void update_soft(std::int64_t now_ns);

  const Settings settings_;
  mutable std::mutex mutex_;  ///< of the next three; held for a swap or an append
  std::vector<display::SceneMoment> fresh_;
  std::optional<std::vector<stimuli::ObjectSpec>> wanted_;
  std::string trouble_;
  std::atomic<bool> held_{false};
  std::atomic<int> steps_{0};  ///< requested while held
  std::atomic<std::uint64_t> recorded_{0};
  std::vector<stimuli::ObjectSpec> shown_;     ///< the recorder's; so the next
  bool running_ = true, anew_ = false;         ///< anew: the scene restarts
  bool stepping_ = false;                      ///< the next samples come from step()
  bool gap_ = false;                           ///< the next sample comes after a pause
  session::Marker marker_;                     ///< of the scene under the hand
  bool begun_ = false, touched_once_ = false;  ///< that scene
  std::int64_t last_ns_ = 0, shown_ns_ = 0;    ///< of the last sample: the servo's, without pauses
  std::int64_t paused_ns_ = 0;                 ///< of all pauses
  servo::Patience patience_;                   ///< with the servo
  servo::TouchedPlaces touched_;               ///< touched places without a sample yet
  std::vector<std::shared_ptr<const display::SoftSurfaceNow>>
      soft_;                  ///< the newest, by soft object
  std::int64_t soft_ns_ = 0;  ///< when they were requested
  servo::ServoThread servo_;
  std::jthread recorder_;  ///< last: ends first
};

}  // namespace palpate::runner::touch
