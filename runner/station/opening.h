#pragma once
// Opens the parts of a live station: device, markers, masking noise, displays.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/devices/registry.h"
#include "runner/display/window.h"
#include "runner/participants/response_box.h"
#include "runner/safety/guarded_device.h"
#include "runner/scene_builder.h"
#include "runner/servo/servo_thread.h"
#include "runner/session/markers.h"
#include "runner/session/sample_stream.h"
#include "runner/sound/player.h"
#include "runner/station/run_settings.h"

namespace palpate::runner::station {

/// \throws UsageError: there is no such device
const devices::DeviceKind& find_device_kind(const std::string& name);

struct OpenDevice {
  std::unique_ptr<servo::Device> device;   ///< in this process, or in the watchdog's
  safety::GuardedDevice* guard = nullptr;  ///< the same; none without force feedback
};
/// Forks the watchdog where the device has force feedback: before there are other threads.
/// \throws UsageError; std::runtime_error: the device cannot be opened
OpenDevice open_device(const devices::DeviceKind& kind, const RunSettings& settings,
                       const protocols::Protocol& protocol);
/// \throws UsageError: the device cannot or should not show the protocol.
void check_fitness(const OpenDevice& open, const RunSettings& settings,
                   const protocols::Protocol& protocol, const StimulusLibrary& library);

servo::ServoSettings servo_settings_of(const protocols::Protocol& protocol);

/// \throws UsageError: --markers has an unknown form; std::runtime_error: it cannot be opened
std::vector<std::unique_ptr<session::MarkerSink>> open_markers(const RunSettings& settings);

/// Null if not requested. \param rate  Hz, of the servo. \throws UsageError: --stream has an
/// unknown form; std::runtime_error where liblsl is missing
std::unique_ptr<session::SampleStream> open_stream(const RunSettings& settings, double rate);

/// For the record, each a line of JSON: where markers and samples go, and the protocol's sounds
/// that are left out. \param player  null: no noise and sounds
std::vector<std::string> notes_on_outlets(const RunSettings& settings,
                                          const protocols::Protocol& protocol,
                                          const sound::SoundPlayer* player);
/// To standard error: what other recorders did not take. \param stream  may be null
void print_dropped(const session::Markers& markers, const session::SampleStream* stream);

/// Whether contacts of a stimulus are heard.
bool has_contact_sound(const protocols::Protocol& protocol);
/// Whether anything is heard.
bool has_sound(const protocols::Protocol& protocol);
inline constexpr std::size_t kHeardTicks = 4096;  ///< that can wait for the sound's thread
/// Asks for real-time scheduling of the calling thread, after the servo's; false: denied.
bool real_time_for_sound();
/// Null with --without-noise, or if nothing is heard. \param heard  of the servo; outlives it
/// \throws SoundError
std::unique_ptr<sound::SoundPlayer> open_sound(const RunSettings& settings,
                                               const protocols::Protocol& protocol,
                                               servo::HeardTicks& heard);

/// Null if no response box is named. \param emergency  commands zero force at once; called in the
/// box's thread. \throws UsageError; std::runtime_error: its port cannot be opened
std::unique_ptr<participants::ResponseBox> open_response_box(
    const RunSettings& settings, const protocols::Protocol& protocol, servo::Clock& clock,
    const std::function<void()>& emergency);
/// Opens two windows, or text where there is no display. \throws DisplayError: the mouse needs a
/// window
/// \param store  has the last places of the windows
/// \param emergency  commands zero force at once; called in the display's thread
std::unique_ptr<display::DisplayLoop> open_display(const RunSettings& settings,
                                                   const protocols::Protocol& protocol,
                                                   data::Store& store, servo::Clock& clock,
                                                   servo::Device& device,
                                                   const std::function<void()>& emergency);

}  // namespace palpate::runner::station
