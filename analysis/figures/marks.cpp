#include "analysis/figures/marks.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate::analysis {

std::vector<std::pair<double, double>> outline_of(MarkerShape shape) {
  constexpr double kArm = 0.36;  // half the width of an arm of the cross
  std::vector<std::pair<double, double>> corners;
  if (shape == MarkerShape::right || shape == MarkerShape::left) {
    corners = {{1, 0}, {-0.8, -1}, {-0.8, 1}};
    if (shape == MarkerShape::left) {
      for (auto& corner : corners) corner.first = -corner.first;
    }
  } else if (shape == MarkerShape::cross || shape == MarkerShape::saltire) {
    corners = {{kArm, -1}, {kArm, -kArm}, {1, -kArm}, {1, kArm},   {kArm, kArm},   {kArm, 1},
               {-kArm, 1}, {-kArm, kArm}, {-1, kArm}, {-1, -kArm}, {-kArm, -kArm}, {-kArm, -1}};
    if (shape == MarkerShape::saltire) {
      const double turn = std::sqrt(0.5);
      for (auto& [x, y] : corners) {
        const double turned = turn * (x - y);
        y = turn * (x + y);
        x = turned;
      }
    }
  }
  return corners;
}

Mark symbol(Role role, MarkerShape shape, double x, double y, double size, std::string text) {
  Mark mark;
  mark.role = role;
  mark.shape = shape;
  mark.x = {x};
  mark.y = {y};
  mark.size = size;
  mark.text = std::move(text);
  return mark;
}

Mark text_mark(Role role, double x, double y, std::string text, double size) {
  Mark mark = symbol(role, MarkerShape::circle, x, y, size, std::move(text));
  mark.kind = Mark::Kind::text;
  return mark;
}

Mark line_mark(Role role, std::vector<double> x, std::vector<double> y, double width) {
  Mark mark;
  mark.kind = Mark::Kind::line;
  mark.role = role;
  mark.x = std::move(x);
  mark.y = std::move(y);
  mark.size = width;
  return mark;
}

Mark rect_mark(Role role, double x0, double y0, double x1, double y1, double opacity,
               std::string text) {
  Mark mark;
  mark.kind = Mark::Kind::rect;
  mark.role = role;
  mark.x = {x0, x1};
  mark.y = {y0, y1};
  mark.opacity = opacity;
  mark.text = std::move(text);
  return mark;
}

void add_interval(Panel& panel, Role role, double x, double low, double high, std::string text) {
  Mark bar;
  bar.kind = Mark::Kind::interval;
  bar.role = role;
  bar.x = {x};
  bar.y = {std::clamp(low, panel.y.low, panel.y.high), std::clamp(high, panel.y.low, panel.y.high)};
  bar.size = 2;
  bar.text = std::move(text);
  panel.marks.push_back(bar);
  const auto end = [&](double y, MarkerShape shape, double half) {
    panel.marks.push_back(symbol(role, shape, x, y, half, bar.text));
  };
  if (high <= panel.y.high) {
    end(bar.y[1], MarkerShape::dash, 5);
  } else {
    end(bar.y[1], MarkerShape::up, 5);
    panel.marks.back().dy = 4;
  }
  if (low >= panel.y.low) {
    end(bar.y[0], MarkerShape::dash, 5);
  } else {
    end(bar.y[0], MarkerShape::down, 5);
    panel.marks.back().dy = -4;
  }
}

void add_interval_across(Panel& panel, Role role, double y, double low, double high,
                         const std::string& text) {
  const double left = std::clamp(low, panel.x.low, panel.x.high);
  const double right = std::clamp(high, panel.x.low, panel.x.high);
  Mark bar = line_mark(role, {left, right}, {y, y}, 2);
  bar.text = text;
  panel.marks.push_back(std::move(bar));
  const double half = 5 * (panel.y.high - panel.y.low) / panel.height;
  const auto end = [&](double x, bool inside, MarkerShape arrow, double dx) {
    if (inside) {
      Mark cap = line_mark(role, {x, x}, {y - half, y + half}, 2);
      cap.text = text;
      panel.marks.push_back(std::move(cap));
    } else {
      panel.marks.push_back(symbol(role, arrow, x, y, 5, text));
      panel.marks.back().dx = dx;
    }
  };
  end(left, low >= panel.x.low, MarkerShape::left, 4);
  end(right, high <= panel.x.high, MarkerShape::right, -4);
}

}  // namespace palpate::analysis
