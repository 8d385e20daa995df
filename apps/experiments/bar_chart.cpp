#include "apps/experiments/bar_chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "apps/team/text_table.hpp"
#include "modules/core/xml_text.hpp"

namespace km {
namespace {

constexpr double kLeft_px = 56.0, kTop_px = 58.0, kHeight_px = 190.0, kBottom_px = 34.0;
constexpr double kBar_px = 34.0, kGap_px = 26.0;
constexpr double kLeast_px = 452.0;  // of three robots and all: charts side by side are alike
constexpr std::array kColours = {"#b9c3d0", "#1f5fa8", "#d98a2b"};

// The next of 1, 2, 2.5, 5 times a power of ten above a quarter of the range.
double round_step(double high) {
  const double rough = std::max(high, 1e-9) / 4.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 2.5, 5.0})
    if (factor * decade >= rough) return factor * decade;
  return 10.0 * decade;
}

class Drawing {
 public:
  explicit Drawing(const BarChart& chart) : chart_(chart) {
    double high = 0.0;
    for (const BarSeries& series : chart.series)
      for (const auto& value : series.values) high = std::max(high, value.value_or(0.0));
    step_ = round_step(high);
    high_ = step_ * std::max(1.0, std::ceil(high / step_ - 1e-9));
    group_px_ = kBar_px * static_cast<double>(chart.series.size()) + kGap_px;
    width_px_ =
        std::max(kLeast_px, kLeft_px + 20.0 + group_px_ * static_cast<double>(chart.groups.size()));
  }

  std::string draw() {
    const double height_px = kTop_px + kHeight_px + kBottom_px;
    svg_ << std::fixed << std::setprecision(1)
         << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << width_px_ << "\" height=\""
         << height_px << "\" font-family=\"sans-serif\" font-size=\"12\">\n"
         << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    text(kLeft_px, 20.0, "start", chart_.title, "font-size=\"14\" font-weight=\"600\"");
    draw_axis();
    for (std::size_t g = 0; g < chart_.groups.size(); ++g) draw_group(g);
    draw_legend();
    svg_ << "</svg>\n";
    return svg_.str();
  }

 private:
  double px_of(double value) const { return kTop_px + kHeight_px * (1.0 - value / high_); }

  void text(double x, double y, const char* anchor, const std::string& content,
            const char* more = "fill=\"#444\"") {
    svg_ << "<text x=\"" << x << "\" y=\"" << y << "\" text-anchor=\"" << anchor << "\" " << more
         << '>' << xml_escaped(content) << "</text>\n";
  }

  void draw_axis() {
    for (double tick = 0.0; tick <= high_ + 0.5 * step_; tick += step_) {
      svg_ << "<path d=\"M" << kLeft_px << ',' << px_of(tick) << " H" << width_px_ - 12.0
           << "\" stroke=\"" << (tick == 0.0 ? "#444" : "#e2e5ea") << "\"/>\n";
      std::ostringstream label;
      label << std::setprecision(4) << tick;
      text(kLeft_px - 6.0, px_of(tick) + 4.0, "end", label.str());
    }
    svg_ << "<text transform=\"translate(14," << kTop_px + 0.5 * kHeight_px
         << ") rotate(-90)\" text-anchor=\"middle\" fill=\"#444\">" << xml_escaped(chart_.y_label)
         << "</text>\n";
  }

  void draw_group(std::size_t group) {
    const double left = kLeft_px + 0.5 * kGap_px + group_px_ * static_cast<double>(group);
    for (std::size_t s = 0; s < chart_.series.size(); ++s) {
      const auto& values = chart_.series[s].values;
      if (group >= values.size() || !values[group]) continue;
      const double x = left + kBar_px * static_cast<double>(s);
      const double top = px_of(*values[group]);
      svg_ << "<rect x=\"" << x + 1.5 << "\" y=\"" << top << "\" width=\"" << kBar_px - 3.0
           << "\" height=\"" << kTop_px + kHeight_px - top << "\" rx=\"1.5\" fill=\""
           << kColours[s % kColours.size()] << "\"/>\n";
      text(x + 0.5 * kBar_px, top - 4.0, "middle", fixed(*values[group], chart_.decimals),
           "fill=\"#444\" font-size=\"11\"");
    }
    text(left + 0.5 * (group_px_ - kGap_px), kTop_px + kHeight_px + 18.0, "middle",
         chart_.groups[group]);
  }

  void draw_legend() {
    double x = kLeft_px;
    for (std::size_t s = 0; s < chart_.series.size(); ++s) {
      svg_ << "<rect x=\"" << x << "\" y=\"29\" width=\"11\" height=\"11\" rx=\"1.5\" fill=\""
           << kColours[s % kColours.size()] << "\"/>\n";
      text(x + 16.0, 39.0, "start", chart_.series[s].name);
      x += 34.0 + 7.0 * static_cast<double>(chart_.series[s].name.size());
    }
  }

  const BarChart& chart_;
  double step_ = 1.0, high_ = 1.0, group_px_ = 0.0, width_px_ = 0.0;
  std::ostringstream svg_;
};

}  // namespace

std::string draw_bars(const BarChart& chart) {
  return Drawing(chart).draw();
}

}  // namespace km
