#pragma once
// Analysis of variance with one factor between participants (the group), or none, and any number
// within them, on one value per participant and cell. Type III: effects are of unweighted means, so
// groups of unequal size do not shift those within participants. As R's afex::aov_car(type = 3).

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace palpate::analysis {

struct WithinFactor {
  std::string name;  ///< "renderer"
  std::size_t levels = 1;
};

/// A participant with a value in every cell.
struct GroupedRow {
  std::size_t group = 0;       ///< index of the group
  std::vector<double> values;  ///< by cell, the levels of the first factor outermost
};

/// F test of an effect.
struct GroupEffect {
  std::string name;       ///< "group", "renderer", "group:renderer", ...
  std::string undefined;  ///< reason for missing values; empty: all that exist are defined
  std::optional<double> num_df, den_df, f, p;
  /// Greenhouse & Geisser (1959), of the residuals pooled over groups; none with one contrast, for
  /// which sphericity is trivial.
  std::optional<double> gg_epsilon, gg_p;
  /// SS / (SS + all error SS); Olejnik & Algina (2003), both factors taken as manipulated.
  std::optional<double> generalized_eta_squared;
  /// Over the family of effects of one measure (Holm); none: not in it.
  std::optional<double> p_holm;

  /// Corrected for sphericity where there is something to correct.
  const std::optional<double>& p_value() const { return gg_p ? gg_p : p; }
};

struct MixedAnova {
  std::string undefined;             ///< reason if nothing can be tested
  std::vector<std::size_t> n;        ///< participants of each group
  std::vector<GroupEffect> effects;  ///< "group", then each within effect and its product
};

/// A standard deviation of differences of these figures that is rounding alone.
double figure_noise(const std::vector<GroupedRow>& rows);

/// \param groups  number of groups; 1: no factor between participants
MixedAnova mixed_anova(const std::vector<GroupedRow>& rows, std::size_t groups,
                       const std::vector<WithinFactor>& within);

}  // namespace palpate::analysis
