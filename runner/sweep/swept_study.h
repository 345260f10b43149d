#pragma once
// The study at a point of a sweep: protocol and settings of the participant with the point's
// values.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/fault_list.h"
#include "protocols/parse.h"
#include "protocols/sweep_space.h"
#include "runner/participants/simulated_settings.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::sweep {

struct PointStudy {
  std::uint64_t seed = 0;        ///< of the participants
  std::uint64_t order_seed = 0;  ///< the protocol's, of schedules and orientations
  nlohmann::json settings;       ///< of the participant
  nlohmann::json protocol;
};

class SweptStudy {
 public:
  /// \param protocol, settings  before anything varies. \param protocol_path  meshes are beside it;
  /// faults of the protocol itself name it. \param space_path  faults of the space name it. \throws
  /// protocols::InputError with every pointer that leads nowhere or to a value of another kind,
  /// with those that are near; also where the protocol refuses a value in the middle of a
  /// distribution
  SweptStudy(nlohmann::json protocol, std::string protocol_path, nlohmann::json settings,
             protocols::SweepSpace space, const std::string& space_path);

  const protocols::SweepSpace& space() const { return space_; }
  const nlohmann::json& protocol() const { return protocol_; }
  const nlohmann::json& settings() const { return settings_; }

  /// \param sweep_seed  with the point's number, from 1, it gives the point's seeds. A sweep that
  /// varies /seed of the protocol keeps that one.
  PointStudy at(std::uint64_t sweep_seed, std::int64_t point,
                const std::vector<nlohmann::json>& values) const;
  /// \throws protocols::InputError, stimuli::MeshError
  protocols::Protocol parse(const nlohmann::json& protocol) const;

 private:
  void check_participant(const protocols::SweepParameter& parameter, std::size_t number,
                         protocols::FaultList& faults) const;
  void check_protocol(const protocols::SweepParameter& parameter, std::size_t number,
                      protocols::FaultList& faults) const;
  /// Why the protocol cannot have this value there, whatever else it has; "": it can.
  std::string refusal_of(const std::string& path, const nlohmann::json& value) const;

  nlohmann::json protocol_;
  std::string protocol_path_;
  nlohmann::json settings_;
  protocols::SweepSpace space_;
  bool varies_order_ = false;  ///< /seed of the protocol
};

}  // namespace palpate::runner::sweep
