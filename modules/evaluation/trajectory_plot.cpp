#include "modules/evaluation/trajectory_plot.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

#include "modules/core/xml_text.hpp"

namespace km {
namespace {

constexpr double kSide_px = 640.0;  // of the drawing, without margins
constexpr double kMargin_px = 40.0;
constexpr double kLegendLine_px = 18.0;
constexpr double kMinStep_px = 0.5;  // points closer than this add nothing to see
constexpr std::array kColours = {"#d62728", "#1f77b4", "#2ca02c", "#9467bd",
                                 "#ff7f0e", "#17becf", "#8c564b", "#e377c2"};

using Line = std::vector<Eigen::Vector2d>;

Line line_between(std::span<const StampedPose> truth, Stamp first, Stamp last) {
  Line line;
  for (const StampedPose& pose : truth)
    if (pose.stamp >= first && pose.stamp <= last)
      line.emplace_back(pose.T.translation().head<2>());
  return line;
}

// Each truth once, over the time that its estimates cover: the rest of a long recording would only
// make what is compared small.
std::vector<Line> truth_lines(std::span<const TrajectoryInput> inputs) {
  struct Drawn {
    std::span<const StampedPose> truth;
    Stamp first, last;
  };
  std::map<const StampedPose*, Drawn> drawn;
  for (const TrajectoryInput& input : inputs) {
    if (input.truth.empty() || input.estimate.empty()) continue;
    const Stamp first = input.estimate.front().stamp;
    const Stamp last = input.estimate.back().stamp;
    Drawn& entry =
        drawn.try_emplace(input.truth.data(), Drawn{input.truth, first, last}).first->second;
    entry.first = std::min(entry.first, first);
    entry.last = std::max(entry.last, last);
  }
  std::vector<Line> lines;
  lines.reserve(drawn.size());
  for (const auto& [key, entry] : drawn)
    lines.push_back(line_between(entry.truth, entry.first, entry.last));
  return lines;
}

Line estimate_line(const TrajectoryInput& input, const Alignment& alignment) {
  Line line;
  for (const StampedPose& pose : input.estimate)
    line.emplace_back(alignment.apply(pose.T).translation().head<2>());
  return line;
}

// Metres to pixels, y upwards.
class Canvas {
 public:
  explicit Canvas(const Eigen::AlignedBox2d& box)
      : box_(box), px_per_m_(kSide_px / std::max(1e-6, box.sizes().maxCoeff())) {}

  Eigen::Vector2d at(const Eigen::Vector2d& p) const {
    return {kMargin_px + (p.x() - box_.min().x()) * px_per_m_,
            kMargin_px + (box_.max().y() - p.y()) * px_per_m_};
  }
  double width() const { return box_.sizes().x() * px_per_m_ + 2.0 * kMargin_px; }
  double height() const { return box_.sizes().y() * px_per_m_ + 2.0 * kMargin_px; }
  double px_per_m() const { return px_per_m_; }

  void draw(std::ostream& svg, const Line& line, const char* colour, double width_px) const {
    svg << "<polyline fill=\"none\" stroke=\"" << colour << "\" stroke-width=\"" << width_px
        << "\" points=\"";
    Eigen::Vector2d last(-1e9, -1e9);
    for (const Eigen::Vector2d& point : line) {
      const Eigen::Vector2d px = at(point);
      if ((px - last).norm() < kMinStep_px) continue;
      svg << px.x() << ',' << px.y() << ' ';
      last = px;
    }
    svg << "\"/>\n";
  }

 private:
  Eigen::AlignedBox2d box_;
  double px_per_m_;
};

// 1, 2 or 5 times a power of ten, about a fifth of the drawing.
double scale_bar_m(double px_per_m) {
  const double wanted_m = 0.2 * kSide_px / px_per_m;
  const double decade = std::pow(10.0, std::floor(std::log10(wanted_m)));
  for (const double step : {5.0, 2.0})
    if (step * decade <= wanted_m) return step * decade;
  return decade;
}

std::string metres_text(double metres) {
  std::ostringstream text;
  text << std::setprecision(3) << metres << " m";
  return text.str();
}

void draw_legend(std::ostream& svg, double top_px, const TeamError& team) {
  double y = top_px;
  const auto entry = [&](const char* colour, const std::string& text) {
    svg << "<text x=\"" << kMargin_px << "\" y=\"" << y << "\" fill=\"" << colour << "\">"
        << xml_escaped(text) << "</text>\n";
    y += kLegendLine_px;
  };
  entry("#888888", "truth");
  for (std::size_t r = 0; r < team.robots.size(); ++r) {
    entry(kColours[r % kColours.size()],
          team.robots[r].name + ", position rmse " + metres_text(team.robots[r].position_m.rmse));
  }
}

}  // namespace

std::string plot_from_above(std::span<const TrajectoryInput> inputs, const TeamError& team) {
  const std::vector<Line> truths = truth_lines(inputs);
  std::vector<Line> estimates;
  Eigen::AlignedBox2d box;
  for (const TrajectoryInput& input : inputs)
    estimates.push_back(estimate_line(input, team.alignment));
  for (const std::vector<Line>* lines : {&truths, &std::as_const(estimates)})
    for (const Line& line : *lines)
      for (const Eigen::Vector2d& point : line) box.extend(point);
  if (box.isEmpty()) box.extend(Eigen::Vector2d::Zero());

  const Canvas canvas(box);
  const double bar_m = scale_bar_m(canvas.px_per_m());
  const double bar_y = canvas.height() - 0.3 * kMargin_px;
  const double legend_y = canvas.height() + kLegendLine_px;
  const double height = legend_y + kLegendLine_px * static_cast<double>(inputs.size() + 1);
  std::ostringstream svg;
  svg << std::fixed << std::setprecision(1) << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\""
      << std::max(canvas.width(), 400.0) << "\" height=\"" << height
      << "\" font-family=\"sans-serif\" font-size=\"13\">\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (const Line& line : truths) canvas.draw(svg, line, "#888888", 3.0);
  for (std::size_t r = 0; r < estimates.size(); ++r)
    canvas.draw(svg, estimates[r], kColours[r % kColours.size()], 1.2);
  svg << "<path d=\"M" << kMargin_px << ',' << bar_y << " h" << bar_m * canvas.px_per_m()
      << "\" stroke=\"black\" stroke-width=\"2\"/>\n<text x=\"" << kMargin_px << "\" y=\""
      << bar_y - 5.0 << "\">" << metres_text(bar_m) << "</text>\n";
  draw_legend(svg, legend_y, team);
  svg << "</svg>\n";
  return svg.str();
}

}  // namespace km
