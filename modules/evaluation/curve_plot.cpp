#include "modules/evaluation/curve_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "modules/core/xml_text.hpp"

namespace km {
namespace {

constexpr double kWidth_px = 560.0, kHeight_px = 260.0;  // of the axes of one panel
constexpr double kLeft_px = 70.0, kTop_px = 34.0, kBottom_px = 46.0, kRight_px = 170.0;
constexpr double kPanel_px = kTop_px + kHeight_px + kBottom_px;
constexpr double kLegendLine_px = 18.0;
constexpr double kMinStep_px = 0.5;  // points of a line closer than this add nothing to see
constexpr std::array kColours = {"#1f77b4", "#ff7f0e", "#d62728", "#2ca02c",
                                 "#9467bd", "#17becf", "#8c564b", "#e377c2"};

struct Axis {
  double low = 0.0, high = 1.0;
  std::vector<double> ticks;  // in the axis' own numbers: of a logarithmic one, exponents
};

// Round numbers that span the range in about five steps.
Axis linear_axis(double low, double high) {
  low = std::min(low, 0.0);
  if (!(high > low)) high = low + 1.0;
  const double rough = (high - low) / 5.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * decade;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * decade >= 0.999 * rough) step = factor * decade;
  Axis axis{std::floor(low / step) * step, std::ceil(high / step - 1e-9) * step, {}};
  for (double tick = axis.low; tick <= axis.high + 0.5 * step; tick += step)
    axis.ticks.push_back(tick);
  return axis;
}

// Whole decades; with many, not each of them has a tick.
Axis logarithmic_axis(double low, double high) {
  Axis axis{std::floor(low), std::max(std::ceil(high), std::floor(low) + 1.0), {}};
  const double step = std::ceil((axis.high - axis.low) / 7.0);
  for (double tick = axis.low; tick <= axis.high; tick += step) axis.ticks.push_back(tick);
  return axis;
}

std::string tick_text(double tick, bool log) {
  std::ostringstream text;
  if (log && std::abs(tick) > 3.0)
    text << "1e" << tick;
  else
    text << std::setprecision(6) << (log ? std::pow(10.0, tick) : tick);
  return text.str();
}

// One panel at a height of the document.
class PanelDrawing {
 public:
  PanelDrawing(std::ostream& svg, const CurvePanel& panel, double top_px)
      : svg_(svg), panel_(panel), top_px_(top_px + kTop_px) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    CurvePoint low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
    for (const Curve& curve : panel.curves)
      for (const CurvePoint& point : curve.points) {
        if (!drawable(point)) continue;
        low = {std::min(low.x, point.x), std::min(low.y, scaled(point.y))};
        high = {std::max(high.x, point.x), std::max(high.y, scaled(point.y))};
      }
    if (!(low.x <= high.x)) low = high = {0.0, 0.0};
    x_ = linear_axis(low.x, high.x);
    y_ = panel.log_y ? logarithmic_axis(low.y, high.y) : linear_axis(low.y, high.y);
  }

  void draw() const {
    draw_axes();
    double legend_px = top_px_ + 12.0;
    for (const bool dots : {true, false})  // lines over dots
      for (const Curve& curve : panel_.curves)
        if (curve.dots == dots) draw_curve(curve);
    for (const Curve& curve : panel_.curves) {
      if (curve.name.empty()) continue;
      svg_ << "<text x=\"" << kLeft_px + kWidth_px + 12.0 << "\" y=\"" << legend_px << "\" fill=\""
           << colour_of(curve) << "\">" << xml_escaped(curve.name) << "</text>\n";
      legend_px += kLegendLine_px;
    }
  }

 private:
  double scaled(double y) const { return panel_.log_y ? std::log10(y) : y; }
  bool drawable(const CurvePoint& point) const {
    return std::isfinite(point.x) && std::isfinite(point.y) && (!panel_.log_y || point.y > 0.0);
  }
  static const char* colour_of(const Curve& curve) {
    return kColours[curve.colour % kColours.size()];
  }
  double px_of_x(double x) const {
    return kLeft_px + kWidth_px * (x - x_.low) / (x_.high - x_.low);
  }
  double px_of_scaled(double y) const {
    return top_px_ + kHeight_px * (y_.high - y) / (y_.high - y_.low);
  }

  void text(double x_px, double y_px, const char* anchor, const std::string& content) const {
    svg_ << "<text x=\"" << x_px << "\" y=\"" << y_px << "\" text-anchor=\"" << anchor << "\">"
         << xml_escaped(content) << "</text>\n";
  }

  void draw_axes() const {
    const double bottom_px = top_px_ + kHeight_px;
    svg_ << "<path fill=\"none\" stroke=\"#dddddd\" d=\"";
    for (const double tick : x_.ticks)
      svg_ << 'M' << px_of_x(tick) << ',' << top_px_ << " v" << kHeight_px << ' ';
    for (const double tick : y_.ticks)
      svg_ << 'M' << kLeft_px << ',' << px_of_scaled(tick) << " h" << kWidth_px << ' ';
    svg_ << "\"/>\n<path fill=\"none\" stroke=\"black\" d=\"M" << kLeft_px << ',' << top_px_ << " v"
         << kHeight_px << " h" << kWidth_px << "\"/>\n";
    for (const double tick : x_.ticks)
      text(px_of_x(tick), bottom_px + 16.0, "middle", tick_text(tick, false));
    for (const double tick : y_.ticks)
      text(kLeft_px - 6.0, px_of_scaled(tick) + 4.0, "end", tick_text(tick, panel_.log_y));
    text(kLeft_px, top_px_ - 12.0, "start", panel_.title);
    text(kLeft_px + 0.5 * kWidth_px, bottom_px + 34.0, "middle", panel_.x_label);
    svg_ << "<text transform=\"translate(16," << top_px_ + 0.5 * kHeight_px
         << ") rotate(-90)\" text-anchor=\"middle\">" << xml_escaped(panel_.y_label) << "</text>\n";
  }

  void draw_curve(const Curve& curve) const {
    svg_ << "<path fill=\"none\" stroke=\"" << colour_of(curve) << "\" stroke-linecap=\"round\" "
         << (curve.dots ? "stroke-width=\"2.6\" opacity=\"0.35\"" : "stroke-width=\"1.6\"")
         << " d=\"";
    CurvePoint last{-1e9, -1e9};
    bool begun = false;
    for (const CurvePoint& point : curve.points) {
      if (!drawable(point)) continue;
      const CurvePoint px{px_of_x(point.x), px_of_scaled(scaled(point.y))};
      if (std::hypot(px.x - last.x, px.y - last.y) < kMinStep_px) continue;
      svg_ << (curve.dots || !begun ? 'M' : 'L') << px.x << ',' << px.y
           << (curve.dots ? "h0 " : " ");
      last = px;
      begun = true;
    }
    svg_ << "\"/>\n";
    if (curve.marks) draw_marks(curve);
  }

  void draw_marks(const Curve& curve) const {
    for (const CurvePoint& point : curve.points)
      if (drawable(point))
        svg_ << "<circle r=\"3\" fill=\"" << colour_of(curve) << "\" cx=\"" << px_of_x(point.x)
             << "\" cy=\"" << px_of_scaled(scaled(point.y)) << "\"/>\n";
  }

  std::ostream& svg_;
  const CurvePanel& panel_;
  double top_px_;
  Axis x_, y_;
};

}  // namespace

std::string plot_curves(std::span<const CurvePanel> panels) {
  std::ostringstream svg;
  svg << std::fixed << std::setprecision(1) << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\""
      << kLeft_px + kWidth_px + kRight_px << "\" height=\""
      << kPanel_px * static_cast<double>(panels.size())
      << "\" font-family=\"sans-serif\" font-size=\"13\">\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (std::size_t p = 0; p < panels.size(); ++p)
    PanelDrawing(svg, panels[p], kPanel_px * static_cast<double>(p)).draw();
  svg << "</svg>\n";
  return svg.str();
}

}  // namespace km
