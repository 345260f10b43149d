#pragma once
// The study at a point of a sweep: protocol and settings of the participant with the point's
// values.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/sweep_space.h"
#include "runner/participants/simulated_settings.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::sweep {

// Where in the unit cube the points of a sweep lie. A point follows from the design, the seed and
// its number alone, so that any machine can compute any of them.

enum class DesignKind {
  lhs,  ///< Latin hypercube (McKay, Beckman & Conover 1979): of every parameter, one point in each
        ///< of as many equally likely parts as there are points
  sobol,  ///< Sobol's sequence with a digital shift from the seed
  grid,  ///< all combinations of equally spaced shares, both ends included; every value of a choice
  /// Sobol's sequence in twice the dimensions, halves A and B (Saltelli et al. 2010): for each of
  /// the base points A, B, and A with parameter i of B for each i, one after the other
  saltelli,
};
const char* to_string(DesignKind kind);
/// \throws std::invalid_argument naming those that there are
DesignKind design_kind(const std::string& name);

class Design {
 public:
  /// \param wanted  points at most; grid and saltelli round down to a possible number.
  /// \throws std::invalid_argument if that is 0
  Design(DesignKind kind, std::int64_t wanted, std::uint64_t seed,
         const std::vector<protocols::SweepParameter>& parameters);

  std::int64_t size() const { return size_; }
  /// \param point  from 1 to size(). \return a share in [0, 1] for each parameter
  std::vector<double> at(std::int64_t point) const;

 private:
  DesignKind kind_;
  std::uint64_t seed_;
  std::size_t dimensions_;
  std::int64_t size_;
  std::vector<std::int64_t> levels_;  ///< of a grid
  std::vector<bool> choice_;
};

/// The image of `value` under a permutation of 0 .. count - 1 that `key` selects: a Feistel
/// network, walked until it is back in the range (Black & Rogaway 2002). No table of `count`
/// entries.
std::uint64_t permuted(std::uint64_t value, std::uint64_t count, std::uint64_t key);

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
