#include "runner/devices/falcon/stylus_from_ends.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

namespace palpate::runner {
namespace {

constexpr std::size_t kLeastPoints = 4;
constexpr double kLeastSpread = 0.01;  // m, root mean square, in the second widest direction

Eigen::Vector3d eigen(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

RigidFit fit_rigid(std::span<const PairedPoint> points) {
  if (points.size() < kLeastPoints) {
    throw RegistrationError("at least " + std::to_string(kLeastPoints) +
                            " points are needed; there are " + std::to_string(points.size()));
  }
  const auto n = static_cast<double>(points.size());
  Eigen::Vector3d tip_mean = Eigen::Vector3d::Zero(), tail_mean = Eigen::Vector3d::Zero();
  for (const PairedPoint& point : points) {
    tip_mean += eigen(point.tip_frame) / n;
    tail_mean += eigen(point.tail_frame) / n;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const PairedPoint& point : points) {
    covariance +=
        (eigen(point.tip_frame) - tip_mean) * (eigen(point.tail_frame) - tail_mean).transpose() / n;
  }
  if (!covariance.allFinite()) throw RegistrationError("a point is not a number");
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double spread = std::sqrt(svd.singularValues()[1]);
  if (!(spread >= kLeastSpread)) {
    throw RegistrationError("the points lie too nearly on a line (" +
                            std::to_string(std::lround(1e3 * spread)) +
                            " mm across): spread them over the workspace");
  }
  Eigen::Vector3d sign(1, 1, 1);
  // The best orthogonal matrix may be a reflection where points are coplanar or noisy: take the
  // best rotation.
  sign[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  const Eigen::Vector3d shift = tip_mean - rotation * tail_mean;

  RigidFit fit;
  Mat3 columns;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) columns[c][r] = rotation(r, c);
  }
  fit.tail_in_tip = {{shift.x(), shift.y(), shift.z()}, glm::normalize(glm::quat_cast(columns))};
  double sum = 0;
  for (const PairedPoint& point : points) {
    const double off = (eigen(point.tip_frame) - rotation * eigen(point.tail_frame) - shift).norm();
    sum += off * off / n;
    fit.worst = std::max(fit.worst, off);
  }
  fit.residual = std::sqrt(sum);
  return fit;
}

bool StylusFromEnds::update(const Vec3& tip, const Vec3& tail) noexcept {
  const rendering::LineProbe seen{tip, tail_in_tip_.orientation * tail + tail_in_tip_.position};
  stretch_ = glm::length(seen.tail - seen.tip) - length_;
  if (std::abs(stretch_) <= tolerance_) {  // false for NaN
    stylus_ = seen;
    wrong_ = 0;
    return true;
  }
  wrong_ = std::min(wrong_ + 1, kMaxWrong);
  return wrong_ < kMaxWrong;
}

Vec3 StylusFromEnds::to_tail_frame(const Vec3& force) const {
  return glm::conjugate(tail_in_tip_.orientation) * force;
}

}  // namespace palpate::runner
