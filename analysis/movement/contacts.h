#pragma once
// What a hand does while it touches: episodes, stops, strokes, and the exploratory procedures
// (Lederman & Klatzky 1987; that position and force tell them apart: Jansen et al. 2013).

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/movement/signal.h"
#include "stimuli/vec.h"

namespace palpate::analysis {

/// Contact with gaps of less than 50 ms joined, then without those of less than 20 ms.
std::vector<Stretch> contact_episodes(const std::vector<bool>& contact, double rate);

/// Slower than 5 mm/s for 50 ms or more, in contact. (Grunwald et al. 2014; our threshold.)
std::vector<Stretch> stops(const std::vector<bool>& contact, const std::vector<double>& speed,
                           double rate);

/// Movements in contact of 50 ms or more, between stops and turns. A turn: the way of the next 50
/// ms goes off that of the last 50 ms by more than 90 degrees; so a circle is one stroke.
/// (Drewing et al. 2011; our limits.)
std::size_t strokes(const std::vector<bool>& contact, const std::vector<Stretch>& stops,
                    const std::vector<Vec3>& path, double rate);

enum class Procedure { stationary, pressure, lateral, contour };
inline constexpr std::size_t kProcedures = 4;

/// What tells procedures apart, of a tick in contact.
struct ContactMotion {
  double tangential_speed = 0;  ///< m/s
  double normal_force = 0;      ///< N
  bool on_edge = false;
};

/// Of one window: contour on an edge for at least half of the ticks and 10 mm/s or faster along the
/// surface; lateral off edges and as fast; pressure slower, with a range of normal force above 0.3
/// of its mean; else stationary.
Procedure procedure_of(const std::vector<ContactMotion>& window);

/// The procedure of each window of 100 ms without a gap in the contact.
/// \param motion  a value a tick
std::vector<Procedure> procedures(const std::vector<bool>& contact,
                                  const std::vector<ContactMotion>& motion, double rate);

}  // namespace palpate::analysis
