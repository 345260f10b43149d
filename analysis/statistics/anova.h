#pragma once
// Repeated-measures analysis of variance, renderer x shape, on participants' mean log times.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {

/// Departure from sphericity of one effect's contrasts, and what corrects for it.
struct Sphericity {
  /// Why something is missing; empty: all is there. With one degree of freedom there is nothing to
  /// test or to correct, and nothing is here.
  std::string undefined;
  std::optional<double> mauchly_w;  ///< Mauchly (1940)
  /// From Box's (1949) series to its second order. `mauchly_p` is what R's packages print (afex and
  /// car: the number of cells stands in one place of that term where Box has the number of
  /// contrasts), `mauchly_p_box` Box's own.
  std::optional<double> mauchly_p, mauchly_p_box;
  std::optional<double> gg_epsilon, gg_p;                       ///< Greenhouse & Geisser (1959)
  std::optional<double> hf_epsilon_raw, hf_epsilon_used, hf_p;  ///< Huynh & Feldt (1976); used <= 1
};

struct AnovaEffect {
  std::string name;       ///< "renderer", "shape", "renderer:shape"
  std::string undefined;  ///< why F is missing; empty: it is there
  std::optional<double> num_df, den_df, f, p;
  /// SS / (SS + SS_participants + all three error SS); Olejnik & Algina (2003).
  std::optional<double> generalized_eta_squared;
  Sphericity sphericity;
};

struct RmAnova {
  std::string undefined;  ///< why there is no two-way analysis; an effect may stand all the same
  std::size_t n_participants_used = 0;
  std::array<AnovaEffect, 3> effects;  ///< renderer, shape, renderer:shape
  std::vector<std::size_t> dropped;    ///< participants without a time in some cell
};

/// On the participants who have a time in every cell. Any numbers of renderers and shapes.
RmAnova rm_anova(const People& people);

}  // namespace palpate::analysis
