#include "analysis/figures/label_placement.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "analysis/figures/svg.h"

namespace palpate::analysis {

namespace {

constexpr double kPoint = 7;               // px: half the width of a point and its margin
constexpr double kBeside = 11;             // px from the point to its label
constexpr double kLeft = 12, kRight = 12;  // px beside the panel that a label may take

/// Axis-aligned rectangle in px from the panel's upper left corner, y down.
struct Box {
  double left, right, top, bottom;

  bool meets(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

class Placement {
 public:
  Placement(const Panel& panel, double width) : panel_(panel), width_(width) {
    for (const Mark& mark : panel.marks) {
      if (mark.kind == Mark::Kind::line) {
        for (std::size_t i = 1; i < mark.x.size(); ++i) {
          take_segment(mark.x[i - 1], mark.y[i - 1], mark.x[i], mark.y[i]);
        }
      } else if (mark.kind == Mark::Kind::interval) {
        take_segment(mark.x[0], mark.y[0], mark.x[0], mark.y[1]);
      } else if (mark.kind == Mark::Kind::label) {
        const double px = x(mark.x[0]), py = y(mark.y[0]);
        taken_.push_back({px - kPoint, px + kPoint, py - kPoint, py + kPoint});
      }
    }
  }

  /// Chooses the candidate position with the fewest overlaps and marks it as taken.
  Mark put(const Mark& label) {
    Mark best;
    Box best_box{};
    std::ptrdiff_t fewest = std::ssize(taken_) + 4;
    for (const double dy : {4.0, -10.0, 19.0, -26.0, 35.0, -44.0, 53.0, -62.0, 71.0}) {
      for (const int anchor : {-1, 1}) {
        Mark text = label;
        text.kind = Mark::Kind::text;
        text.anchor = anchor;
        text.dx = -kBeside * anchor;
        text.dy = dy;
        const Box box = box_of(text);
        const std::ptrdiff_t hidden = n_hidden(box);
        if (hidden >= fewest) continue;
        fewest = hidden;
        best = std::move(text);
        best_box = box;
      }
    }
    taken_.push_back(best_box);
    return best;
  }

 private:
  void take_segment(double x0, double y0, double x1, double y1) {
    constexpr int kPieces = 4;  // of an oblique segment: one bounding box would cover too much
    const int pieces = x0 == x1 || y0 == y1 ? 1 : kPieces;
    for (int i = 0; i < pieces; ++i) {
      const double from = static_cast<double>(i) / pieces, to = static_cast<double>(i + 1) / pieces;
      const auto [left, right] =
          std::minmax({x(std::lerp(x0, x1, from)), x(std::lerp(x0, x1, to))});
      const auto [top, bottom] =
          std::minmax({y(std::lerp(y0, y1, from)), y(std::lerp(y0, y1, to))});
      taken_.push_back({left - 2, right + 2, top - 2, bottom + 2});
    }
  }

  double x(double value) const {
    return (value - panel_.x.low) / (panel_.x.high - panel_.x.low) * width_;
  }
  double y(double value) const {
    return (panel_.y.high - value) / (panel_.y.high - panel_.y.low) * panel_.height;
  }

  Box box_of(const Mark& text) const {
    const double wide = text_width(text.text, text.size, text.bold);
    const double left = x(text.x[0]) + text.dx - (text.anchor > 0 ? wide : 0);
    const double base = y(text.y[0]) + text.dy;
    return {left, left + wide, base - text.size, base + 3};
  }

  /// Overlaps of a box; extending beyond the panel counts as three.
  std::ptrdiff_t n_hidden(const Box& box) const {
    const bool outside = box.left < -kLeft || box.right > width_ + kRight;
    return std::ranges::count_if(taken_, [&](const Box& other) { return box.meets(other); }) +
           (outside ? 3 : 0);
  }

  const Panel& panel_;
  double width_;
  std::vector<Box> taken_;  ///< points, intervals, lines, then labels placed so far
};

}  // namespace

std::vector<Mark> placed_labels(const Panel& panel, double width) {
  Placement placement(panel, width);
  std::vector<Mark> texts;
  for (const Mark& mark : panel.marks) {
    if (mark.kind == Mark::Kind::label) texts.push_back(placement.put(mark));
  }
  return texts;
}

}  // namespace palpate::analysis
