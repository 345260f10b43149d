#pragma once

#include <optional>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/movement/pictures.h"

namespace palpate::analysis {

/// The figures for which there are data: movement-paths (a typical trial on three views of its
/// object), movement-contact (where surfaces were touched), movement-speed (speed over time with
/// movements and contact), movement-coverage (share of the surface over time), movement-procedures
/// (share of exploratory procedures). Shapes beyond the first eight and renderers beyond the first
/// four are left out, with a note.
std::vector<Figure> movement_figures(const MovementTable& table, const MovementPictures& pictures);

/// Mean over participants' means of an untransformed share; none: no trial has it.
std::optional<double> mean_share(const MovementTable& table, std::size_t measure,
                                 std::size_t renderer, std::size_t shape);

}  // namespace palpate::analysis
