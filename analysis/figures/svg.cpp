#include "analysis/figures/svg.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <initializer_list>
#include <utility>

#include "analysis/text.h"
#include "data/base/utf8.h"

namespace palpate::analysis {

const char* to_string(Role role) {
  constexpr const char* kNames[kRoles] = {"page",   "ink",   "soft",  "grid",    "point",
                                          "ray",    "paper", "heat",  "amber",   "third",
                                          "fourth", "fifth", "sixth", "seventh", "eighth"};
  return kNames[static_cast<std::size_t>(role)];
}

Palette light_palette() {
  return {"#ffffff", "#1f2328", "#59636e", "#e3e6ea", "#0072b2", "#d55e00", "#00795a", "#0072b2",
          "#8a5a00", "#aa3377", "#009e73", "#000000", "#665c00", "#b87a00", "#3a8fc4"};
}

Palette dark_palette() {
  return {"#171b1f", "#e6e9ec", "#a3adb8", "#30373e", "#56b4e9", "#f28b3c", "#2fbf96", "#56b4e9",
          "#f0b84a", "#e08bbf", "#35d0a5", "#ffffff", "#f0e442", "#e69f00", "#b3e0ff"};
}

Palette page_palette() {
  Palette palette;
  for (std::size_t r = 0; r < kRoles; ++r) {
    palette[r] = std::string("var(--") + to_string(static_cast<Role>(r)) + ")";
  }
  return palette;
}

Role line_role(std::size_t line) {
  constexpr std::array kLines{Role::point,   Role::ray,    Role::fourth, Role::third,
                              Role::seventh, Role::eighth, Role::ink,    Role::soft};
  return kLines[line % kLines.size()];
}

namespace {

constexpr std::string_view kFont =
    "'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif";

/// Two decimals, no exponent, ASCII minus, as SVG requires.
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
               double width, double opacity, bool dashed) {
  body_ += "<polyline" + points(x, y) + " fill=\"none\"" + attribute("stroke", stroke) +
           attribute("stroke-width", width) + attribute("stroke-opacity", opacity) +
           (dashed ? " stroke-dasharray=\"5 5\"" : "") + "/>\n";
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
  if (style.rotation != 0) {
    std::string turn = "rotate(";
    turn += coordinate(style.rotation) + ' ' + coordinate(x) + ' ' + coordinate(y) + ')';
    body_ += attribute("transform", turn);
  }
  body_ += ">" + escaped(text) + "</text>\n";
}

void Svg::begin_group(std::string_view title, std::string_view participant) {
  body_ += "<g";
  if (!participant.empty()) body_ += attribute("data-person", participant);
  body_ += '>';
  if (!title.empty()) body_ += "<title>" + escaped(title) + "</title>";
  body_ += '\n';
}

void Svg::begin_standalone() { body_ += "<g class=\"alone\">\n"; }

void Svg::end_group() { body_ += "</g>\n"; }

std::string Svg::document(double width, double height, std::string_view title,
                          std::string_view description, std::string_view id,
                          const std::optional<Part>& shown) const {
  const auto whole_px = [](double length) { return std::to_string(static_cast<int>(length)); };
  const Part part = shown.value_or(Part{0, width, 0, height});
  const std::string w = whole_px(part.right - part.left), h = whole_px(part.bottom - part.top);
  const std::string name = escaped(id);
  std::string size =
      attribute("width", w) + attribute("height", h) +
      attribute("viewBox", whole_px(part.left) + " " + whole_px(part.top) + " " + w + " " + h);
  if (shown) {
    size += attribute("data-whole", "0 0 " + whole_px(width) + " " + whole_px(height));
  }
  return "<svg xmlns=\"http://www.w3.org/2000/svg\"" + size +
         " style=\"min-width:" + whole_px(0.65 * (part.right - part.left)) + "px;max-width:" + w +
         "px\" role=\"img\" aria-labelledby=\"" + name + "-title " + name +
         "-description\" font-family=\"" + std::string(kFont) + "\">\n<title id=\"" + name +
         "-title\">" + escaped(title) + "</title>\n<desc id=\"" + name + "-description\">" +
         escaped(description) + "</desc>\n" + body_ + "</svg>\n";
}

double text_width(std::string_view text, double size, bool bold) {
  // Advance widths of DejaVu Sans from U+0020 on, thousandths of the font size: the widest of the
  // fonts above.
  constexpr std::array<short, 95> kWidths{
      318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337,
      636, 636, 636, 636, 636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531,
      999, 684, 686, 698, 770, 632, 575, 775, 752, 295, 295, 656, 557, 863, 748, 787,
      603, 787, 695, 635, 611, 732, 684, 989, 685, 611, 685, 390, 337, 390, 838, 500,
      500, 613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579, 278, 974, 634, 612,
      635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838};
  constexpr double kBold = 1.13, kOther = 700, kWide = 1050;
  double thousandths = 0;
  for (const char c : text) {
    const auto byte = static_cast<std::uint8_t>(c);
    if (byte >= 0x20 && byte < 0x7F) {
      thousandths += kWidths[byte - 0x20];
    } else if (!continues_character(c)) {  // from 0xE3 on: East Asian, full width
      thousandths += byte >= 0xE3 ? kWide : kOther;
    }
  }
  return thousandths / 1000 * size * (bold ? kBold : 1);
}

std::string fitting(std::string_view text, double width, double size) {
  std::size_t columns = analysis::width(text);
  while (columns > 1 && text_width(shortened(text, columns), size) > width) --columns;
  return shortened(text, columns);
}

std::vector<std::string> lines_of(std::string_view text, double width, double size, bool bold) {
  return wrapped(text,
                 [&](std::string_view line) { return text_width(line, size, bold) <= width; });
}

}  // namespace palpate::analysis
