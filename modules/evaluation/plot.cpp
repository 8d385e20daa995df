#include "modules/evaluation/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "modules/core/text_table.hpp"
#include "modules/core/xml_text.hpp"

namespace km {
namespace {

using Style = PlotSeries::Style;

constexpr double kWidth_px = 560.0, kHeight_px = 260.0;  // of the axes; of a map, the longer one
constexpr double kLeft_px = 70.0, kTop_px = 34.0, kBottom_px = 46.0, kRight_px = 24.0;
constexpr double kLegendLine_px = 18.0, kLetter_px = 7.5;
constexpr double kMinStep_px = 0.5;  // points of a line closer than this add nothing to see
constexpr double kMapMargin = 0.03;  // of the longer range
constexpr double kBars = 0.75;       // share of a group's width that its bars take
constexpr std::array kColours = {"#1f77b4", "#ff7f0e", "#d62728", "#2ca02c",
                                 "#9467bd", "#17becf", "#8c564b", "#e377c2"};

const char* colour_of(const PlotSeries& series) {
  return series.colour == PlotSeries::kGrey ? "#888888" : kColours[series.colour % kColours.size()];
}

// In its own numbers: of a logarithmic one, exponents.
struct Axis {
  double low = 0.0, high = 1.0;
  double first = 0.0, step = 1.0;  // of the ticks
};

// 1, 2 or 5 times a power of ten, at least a fifth of the range.
double round_step(double range) {
  const double rough = (range > 0.0 ? range : 1.0) / 5.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * decade >= 0.999 * rough) return factor * decade;
  return 10.0 * decade;
}

Axis linear_axis(double low, double high, double step) {
  if (!(high > low)) high = low + step;
  const double first = std::floor(low / step) * step;
  return {first, std::ceil(high / step - 1e-9) * step, first, step};
}

// The range itself, with a margin.
Axis tight_axis(double low, double high, double margin, double step) {
  return {low - margin, high + margin, std::ceil((low - margin) / step) * step, step};
}

// Whole decades; with many, not each of them has a tick.
Axis logarithmic_axis(double low, double high) {
  const double first = std::floor(low);
  Axis axis{first, std::max(std::ceil(high), first + 1.0), first, 1.0};
  axis.step = std::ceil((axis.high - axis.low) / 7.0);
  return axis;
}

std::string tick_text(double tick, bool log) {
  if (log && std::abs(tick) > 3.0) return "1e" + fixed(tick, 0);
  return rounded(log ? std::pow(10.0, tick) : tick, 6);
}

// One plot at a height of the document.
class Drawing {
 public:
  Drawing(const Plot& plot, double top_px) : plot_(plot), top_px_(top_px + kTop_px) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    PlotPoint low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
    for (const PlotSeries& series : plot.series)
      for (const PlotPoint& point : series.points) {
        if (!drawable(point)) continue;
        low = {std::min(low.x, point.x), std::min(low.y, scaled(point.y))};
        high = {std::max(high.x, point.x), std::max(high.y, scaled(point.y))};
      }
    if (!(low.x <= high.x)) low = high = {0.0, 0.0};
    if (plot.is_map) {
      const double range = std::max({high.x - low.x, high.y - low.y, 1e-6});
      x_ = tight_axis(low.x, high.x, kMapMargin * range, round_step(range));
      y_ = tight_axis(low.y, high.y, kMapMargin * range, round_step(range));
      const double px_per_unit = kWidth_px / std::max(x_.high - x_.low, y_.high - y_.low);
      width_px_ = px_per_unit * (x_.high - x_.low);
      height_px_ = px_per_unit * (y_.high - y_.low);
      return;
    }
    const auto from_zero = [](double least, double most) {
      least = std::min(least, 0.0);
      return linear_axis(least, most, round_step(most - least));
    };
    x_ = plot.groups.empty() ? from_zero(low.x, high.x)
                             : Axis{-0.5, static_cast<double>(plot.groups.size()) - 0.5};
    y_ = plot.log_y ? logarithmic_axis(low.y, high.y) : from_zero(low.y, high.y);
  }

  [[nodiscard]] double width_px() const {
    std::size_t letters = 0;
    for (const PlotSeries& series : plot_.series) letters = std::max(letters, series.name.size());
    return kLeft_px + width_px_ + kRight_px + kLetter_px * static_cast<double>(letters);
  }
  [[nodiscard]] double bottom_px() const { return top_px_ + height_px_ + kBottom_px; }

  [[nodiscard]] std::string svg() {
    svg_ << std::fixed << std::setprecision(1);
    draw_axes();
    for (const bool dots : {true, false})  // lines over dots
      for (const PlotSeries& series : plot_.series)
        if ((series.style == Style::kDots) == dots)
          series.style == Style::kBars ? draw_bars(series) : draw_line(series);
    double legend_px = top_px_ + 12.0;
    for (const PlotSeries& series : plot_.series) {
      if (series.name.empty()) continue;
      text(kLeft_px + width_px_ + 12.0, legend_px, "start", series.name, colour_of(series));
      legend_px += kLegendLine_px;
    }
    return svg_.str();
  }

 private:
  double scaled(double y) const { return plot_.log_y ? std::log10(y) : y; }
  bool drawable(const PlotPoint& point) const {
    return std::isfinite(point.x) && std::isfinite(point.y) && (!plot_.log_y || point.y > 0.0);
  }
  double px_of_x(double x) const {
    return kLeft_px + width_px_ * (x - x_.low) / (x_.high - x_.low);
  }
  double px_of_scaled(double y) const {
    return top_px_ + height_px_ * (y_.high - y) / (y_.high - y_.low);
  }
  PlotPoint px_of(const PlotPoint& point) const {
    return {px_of_x(point.x), px_of_scaled(scaled(point.y))};
  }

  void text(double x_px, double y_px, const char* anchor, const std::string& content,
            const char* colour = "black") {
    svg_ << "<text x=\"" << x_px << "\" y=\"" << y_px << "\" text-anchor=\"" << anchor
         << "\" fill=\"" << colour << "\">" << xml_escaped(content) << "</text>\n";
  }

  // Calls use(tick) for those of an axis.
  static void for_each_tick(const Axis& axis, const auto& use) {
    for (int k = 0;; ++k) {
      const double tick = axis.first + k * axis.step;
      if (tick > axis.high + 0.01 * axis.step) return;
      use(std::abs(tick) < 1e-9 * axis.step ? 0.0 : tick);  // nor -0, nor what rounding leaves
    }
  }

  void draw_axes() {
    const double bottom_px = top_px_ + height_px_;
    const bool grouped = !plot_.groups.empty();
    svg_ << "<path fill=\"none\" stroke=\"#dddddd\" d=\"";
    if (!grouped)
      for_each_tick(x_, [&](double tick) {
        svg_ << 'M' << px_of_x(tick) << ',' << top_px_ << " v" << height_px_ << ' ';
      });
    for_each_tick(y_, [&](double tick) {
      svg_ << 'M' << kLeft_px << ',' << px_of_scaled(tick) << " h" << width_px_ << ' ';
    });
    svg_ << "\"/>\n<path fill=\"none\" stroke=\"black\" d=\"M" << kLeft_px << ',' << top_px_ << " v"
         << height_px_ << " h" << width_px_ << "\"/>\n";
    for (std::size_t g = 0; g < plot_.groups.size(); ++g)
      text(px_of_x(static_cast<double>(g)), bottom_px + 16.0, "middle", plot_.groups[g]);
    if (!grouped)
      for_each_tick(x_, [&](double tick) {
        text(px_of_x(tick), bottom_px + 16.0, "middle", tick_text(tick, false));
      });
    for_each_tick(y_, [&](double tick) {
      text(kLeft_px - 6.0, px_of_scaled(tick) + 4.0, "end", tick_text(tick, plot_.log_y));
    });
    text(kLeft_px, top_px_ - 12.0, "start", plot_.title);
    text(kLeft_px + 0.5 * width_px_, bottom_px + 34.0, "middle", plot_.x_label);
    svg_ << "<text transform=\"translate(16," << top_px_ + 0.5 * height_px_
         << ") rotate(-90)\" text-anchor=\"middle\">" << xml_escaped(plot_.y_label) << "</text>\n";
  }

  void draw_line(const PlotSeries& series) {
    const bool dots = series.style == Style::kDots;
    svg_ << "<path fill=\"none\" stroke=\"" << colour_of(series)
         << "\" stroke-linecap=\"round\" stroke-width=\"" << (dots ? 2.6 : series.width_px) << '"'
         << (dots ? " opacity=\"0.35\"" : "") << " d=\"";
    PlotPoint last{-1e9, -1e9};
    bool begun = false;
    for (const PlotPoint& point : series.points) {
      if (!drawable(point)) continue;
      const PlotPoint px = px_of(point);
      if (std::hypot(px.x - last.x, px.y - last.y) < kMinStep_px) continue;
      svg_ << (dots || !begun ? 'M' : 'L') << px.x << ',' << px.y << (dots ? "h0 " : " ");
      last = px;
      begun = true;
    }
    svg_ << "\"/>\n";
    if (series.style != Style::kMarkedLine) return;
    for (const PlotPoint& point : series.points)
      if (drawable(point))
        svg_ << "<circle r=\"3\" fill=\"" << colour_of(series) << "\" cx=\"" << px_of(point).x
             << "\" cy=\"" << px_of(point).y << "\"/>\n";
  }

  // Beside those of the other series with bars.
  void draw_bars(const PlotSeries& series) {
    const auto is_bars = [](const PlotSeries& other) { return other.style == Style::kBars; };
    const auto count = std::count_if(plot_.series.begin(), plot_.series.end(), is_bars);
    const auto place = std::count_if(plot_.series.data(), &series, is_bars);
    const double width = kBars / static_cast<double>(count);
    for (const PlotPoint& point : series.points) {
      if (!drawable(point)) continue;
      const double left = point.x - 0.5 * kBars + width * static_cast<double>(place);
      const double top_px = px_of(point).y;
      svg_ << "<rect x=\"" << px_of_x(left) + 1.5 << "\" y=\"" << top_px << "\" width=\""
           << px_of_x(left + width) - px_of_x(left) - 3.0 << "\" height=\""
           << top_px_ + height_px_ - top_px << "\" fill=\"" << colour_of(series) << "\"/>\n";
      text(px_of_x(left + 0.5 * width), top_px - 4.0, "middle", fixed(point.y, plot_.decimals));
    }
  }

  const Plot& plot_;
  double top_px_, width_px_ = kWidth_px, height_px_ = kHeight_px;
  Axis x_, y_;
  std::ostringstream svg_;
};

}  // namespace

std::string draw_plots(std::span<const Plot> plots) {
  std::string drawn;
  double width_px = 0.0, height_px = 0.0;
  for (const Plot& plot : plots) {
    Drawing drawing(plot, height_px);
    drawn += drawing.svg();
    width_px = std::max(width_px, drawing.width_px());
    height_px = drawing.bottom_px();
  }
  std::ostringstream svg;
  svg << std::fixed << std::setprecision(1)
      << "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" viewBox=\"0 0 " << width_px << ' '
      << height_px << "\" width=\"" << width_px << "\" height=\"" << height_px
      << "\" font-family=\"sans-serif\" font-size=\"13\">\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      << drawn << "</svg>\n";
  return svg.str();
}

}  // namespace km
