#include "analysis/svg.h"

#include <charconv>
#include <initializer_list>
#include <utility>

#include "analysis/text.h"

namespace palpate {

namespace {

constexpr std::string_view kFont =
    "'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif";

/// Two decimals, never an exponent, a plain minus: what SVG reads.
std::string coordinate(double value) {
  char digits[512];
  const auto end =
      std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, 2).ptr;
  return std::string(digits, end);
}

/// ` name="value"`
std::string attribute(std::string_view name, std::string_view value) {
  std::string text(1, ' ');
  text += name;
  text += "=\"";
  text += escaped(value);
  text += '"';
  return text;
}

std::string attribute(std::string_view name, double value) {
  return attribute(name, coordinate(value));
}

std::string points(std::initializer_list<std::pair<double, double>> corners) {
  std::string text;
  for (const auto& [x, y] : corners) {
    if (!text.empty()) text += ' ';
    text += coordinate(x);
    text += ',';
    text += coordinate(y);
  }
  return attribute("points", text);
}

std::string points(const std::vector<double>& x, const std::vector<double>& y) {
  std::string text;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (i > 0) text += ' ';
    text += coordinate(x[i]);
    text += ',';
    text += coordinate(y[i]);
  }
  return attribute("points", text);
}

}  // namespace

void Svg::line(double x1, double y1, double x2, double y2, std::string_view colour, double width,
               double opacity) {
  body_ += "<line" + attribute("x1", x1) + attribute("y1", y1) + attribute("x2", x2) +
           attribute("y2", y2) + attribute("stroke", colour) + attribute("stroke-width", width) +
           attribute("stroke-opacity", opacity) + "/>\n";
}

void Svg::rect(double x, double y, double width, double height, std::string_view fill,
               std::string_view stroke, double corner) {
  body_ += "<rect" + attribute("x", x) + attribute("y", y) + attribute("width", width) +
           attribute("height", height) + attribute("fill", fill) + attribute("stroke", stroke) +
           attribute("rx", corner) + "/>\n";
}

void Svg::circle(double x, double y, double radius, std::string_view fill, double opacity) {
  body_ += "<circle" + attribute("cx", x) + attribute("cy", y) + attribute("r", radius) +
           attribute("fill", fill) + attribute("fill-opacity", opacity) + "/>\n";
}

void Svg::square(double x, double y, double half, std::string_view fill, double opacity) {
  body_ += "<rect" + attribute("x", x - half) + attribute("y", y - half) +
           attribute("width", 2 * half) + attribute("height", 2 * half) + attribute("fill", fill) +
           attribute("fill-opacity", opacity) + "/>\n";
}

void Svg::diamond(double x, double y, double half, std::string_view stroke, std::string_view fill) {
  body_ += "<polygon" + points({{x, y - half}, {x + half, y}, {x, y + half}, {x - half, y}}) +
           attribute("fill", fill) + attribute("stroke", stroke) + " stroke-width=\"2\"/>\n";
}

void Svg::area(const std::vector<double>& x, const std::vector<double>& y, std::string_view fill,
               double opacity, std::string_view stroke, double width) {
  body_ += "<polygon" + points(x, y) + attribute("fill", fill) +
           attribute("fill-opacity", opacity) + attribute("stroke", stroke) +
           attribute("stroke-width", width) + "/>\n";
}

void Svg::path(const std::vector<double>& x, const std::vector<double>& y, std::string_view stroke,
               double width, double opacity) {
  body_ += "<polyline" + points(x, y) + " fill=\"none\"" + attribute("stroke", stroke) +
           attribute("stroke-width", width) + attribute("stroke-opacity", opacity) + "/>\n";
}

void Svg::triangle(double x, double y, double half, bool up, std::string_view fill) {
  const double tip = up ? -half : half;
  body_ += "<polygon" + points({{x, y + tip}, {x + half, y - tip}, {x - half, y - tip}}) +
           attribute("fill", fill) + "/>\n";
}

void Svg::text(double x, double y, std::string_view text, const TextStyle& style) {
  constexpr std::string_view kAnchors[] = {"start", "middle", "end"};
  body_ += "<text" + attribute("x", x) + attribute("y", y) + attribute("font-size", style.size) +
           attribute("fill", style.colour) +
           attribute("text-anchor", kAnchors[static_cast<int>(style.anchor)]);
  if (style.bold) body_ += " font-weight=\"700\"";
  if (style.turned != 0) {
    std::string turn = "rotate(";
    turn += coordinate(style.turned) + ' ' + coordinate(x) + ' ' + coordinate(y) + ')';
    body_ += attribute("transform", turn);
  }
  body_ += ">" + escaped(text) + "</text>\n";
}

void Svg::begin_group(std::string_view title) {
  body_ += "<g><title>" + escaped(title) + "</title>\n";
}

void Svg::end_group() { body_ += "</g>\n"; }

std::string Svg::document(double width, double height, std::string_view title,
                          std::string_view description, std::string_view id) const {
  const std::string w = std::to_string(static_cast<int>(width)),
                    h = std::to_string(static_cast<int>(height)), name = escaped(id);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "\" height=\"" + h +
         "\" viewBox=\"0 0 " + w + " " + h +
         "\" style=\"min-width:" + std::to_string(static_cast<int>(0.65 * width)) +
         "px\" role=\"img\" aria-labelledby=\"" + name + "-title " + name +
         "-description\" font-family=\"" + std::string(kFont) + "\">\n<title id=\"" + name +
         "-title\">" + escaped(title) + "</title>\n<desc id=\"" + name + "-description\">" +
         escaped(description) + "</desc>\n" + body_ + "</svg>\n";
}

double text_width(std::string_view text, double size, bool bold) {
  return static_cast<double>(width(text)) * size * (bold ? 0.52 : 0.48);
}

std::vector<std::string> lines_of(std::string_view text, double width, double size, bool bold) {
  return wrapped(text,
                 [&](std::string_view line) { return text_width(line, size, bold) <= width; });
}

}  // namespace palpate
