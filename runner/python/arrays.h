#pragma once
// Between tables of the program and arrays of numpy.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <vector>

#include "data/column_table.h"
#include "runner/commands/render/forces.h"

namespace palpate::runner {

/// A dict of column name -> one-dimensional array: float64, int64, bool or text.
pybind11::dict arrays_of(const data::ColumnTable& table);

using Coordinates =
    pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// \param columns  t (s), tip and tail (m) and, with ten, the tool's +x, each of one length.
/// \throws protocols::InputError naming what is wrong, as read_trajectory does of a file
std::vector<commands::TimedPose> poses_of(const std::vector<Coordinates>& columns);

}  // namespace palpate::runner
