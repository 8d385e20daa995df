#include "modules/evaluation/images/track_statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

constexpr double kSurvives_px = 1.0;
constexpr double kSurvivesStrictly_px = 0.5;
constexpr float kRim_px = 10.0F;
constexpr double kUsualStep = 1.6;  // longest step without a missing frame, over the shortest step
constexpr std::size_t kMaxAge = 40;
constexpr std::array<std::size_t, 6> kAges = {1, 2, 5, 10, 20, 40};
constexpr std::size_t kAgeByFlow = 10;

bool is_inside(const cv::Mat& image, const cv::Point2f& p, float rim = 0.0F) {
  return p.x >= rim && p.y >= rim && p.x < static_cast<float>(image.cols) - rim &&
         p.y < static_cast<float>(image.rows) - rim;
}

}  // namespace

double TrackStatistics::add(Stamp stamp, const KltImage& image,
                            const std::vector<cv::Point2f>& corners) {
  double flow_px = std::numeric_limits<double>::quiet_NaN();
  const bool follows =
      frames_ > 0 && stamp > last_stamp_ && seconds_between(last_stamp_, stamp) <= max_step_s_;
  if (follows) {
    const double step_s = seconds_between(last_stamp_, stamp);
    period_s_ = std::min(period_s_, step_s);
    const Step step = one_step(image);
    if (step_s < kUsualStep * period_s_) {
      record(step);
      flow_px = step.flow_px;
    }
    follow(image, step.flow_px);
  } else {
    sets_.clear();
  }
  corner_counts_.push_back(static_cast<double>(corners.size()));
  if (frames_ % static_cast<std::size_t>(stride_) == 0 && !corners.empty())
    sets_.push_back({corners.size(), 0, 0.0, corners, std::vector<bool>(corners.size(), true)});
  ++frames_;
  last_stamp_ = stamp;
  last_ = image;
  last_corners_ = corners;
  return flow_px;
}

TrackStatistics::Step TrackStatistics::one_step(const KltImage& image) const {
  Step step;
  std::vector<double> lengths;
  const auto tracks = forward_backward(last_, image, last_corners_);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const cv::Point2f moved = tracks[i].to - last_corners_[i];
    if (tracks[i].error_px < kSurvives_px && is_inside(image.image, tracks[i].to))
      lengths.push_back(std::hypot(moved.x, moved.y));
    else if (!is_inside(image.image, tracks[i].to, kRim_px))
      ++step.left;
  }
  step.corners = static_cast<double>(tracks.size());
  step.survived = static_cast<double>(lengths.size());
  step.flow_px = quantile(std::move(lengths), 0.5);
  return step;
}

void TrackStatistics::record(const Step& step) {
  if (step.corners == 0.0 || std::isnan(step.flow_px)) return;
  const double survived = step.survived / step.corners;
  const double left = step.left / step.corners;
  flow_.push_back(step.flow_px);
  survived_.push_back(survived);
  left_.push_back(left);
  failed_.push_back(1.0 - survived - left);
  survived_by_flow_.add(step.flow_px, survived);
  left_by_flow_.add(step.flow_px, left);
  corners_by_flow_.add(step.flow_px, step.corners);
}

void TrackStatistics::follow(const KltImage& image, double flow_px) {
  for (TrackSet& set : sets_) {
    const auto tracks = forward_backward(last_, image, set.points);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      if (tracks[i].error_px >= kSurvives_px || !is_inside(image.image, tracks[i].to)) continue;
      set.points[kept] = tracks[i].to;
      set.strict[kept] = set.strict[i] && tracks[i].error_px < kSurvivesStrictly_px;
      ++kept;
    }
    set.points.resize(kept);
    set.strict.resize(kept);
    ++set.age;
    set.flow_sum_px += flow_px;
    record(set);
  }
  std::erase_if(sets_, [](const TrackSet& set) { return set.age == kMaxAge; });
}

void TrackStatistics::record(const TrackSet& set) {
  if (std::find(kAges.begin(), kAges.end(), set.age) == kAges.end()) return;
  const auto n = static_cast<double>(set.start_count);
  const double share = static_cast<double>(set.points.size()) / n;
  survival_[set.age].push_back(share);
  strict_survival_[set.age].push_back(
      static_cast<double>(std::count(set.strict.begin(), set.strict.end(), true)) / n);
  if (set.age == kAgeByFlow) ten_frames_by_flow_.add(set.flow_sum_px / kAgeByFlow, share);
}

void TrackStatistics::append_to(std::vector<ImageFigure>& figures) const {
  FigureList corners(figures, "corners a frame (Shi-Tomasi, left)");
  corners.add("mean", mean_of(corner_counts_), 0);
  corners.add_quantiles("", corner_counts_, {0, 5, 50, 95, 100}, 0);

  FigureList survival(figures, "KLT survival without refill, share of corners");
  const auto add = [&](const auto& by_age, const std::string& suffix) {
    for (const std::size_t age : kAges) {
      const auto found = by_age.find(age);
      survival.add(std::to_string(age) + " frames" + suffix,
                   found != by_age.end() ? mean_of(found->second) : mean_of({}));
    }
  };
  add(survival_, "");
  add(strict_survival_, ", 0.5 px");
  for (const std::size_t age : {10U, 20U, 40U})
    if (const auto found = survival_.find(age); found != survival_.end())
      survival.add_quantiles(std::to_string(age) + " frames", found->second, {10});
  std::string by_flow = std::to_string(kAgeByFlow);
  by_flow += " frames, mean ";
  for (std::size_t bin = 0; bin < kFlowBinCount; ++bin)
    survival.add(by_flow + flow_bin_name(bin), ten_frames_by_flow_.mean(bin));

  FigureList step(figures, "KLT, one step of fresh corners");
  step.add("survive", mean_of(survived_));
  step.add("left the image", mean_of(left_));
  step.add("fail otherwise", mean_of(failed_));
  for (std::size_t bin = 0; bin < kFlowBinCount; ++bin) {
    step.add("frames, " + flow_bin_name(bin), survived_by_flow_.count(bin), 0);
    step.add("survive, " + flow_bin_name(bin), survived_by_flow_.mean(bin));
    step.add("left the image, " + flow_bin_name(bin), left_by_flow_.mean(bin));
    step.add("corners, " + flow_bin_name(bin), corners_by_flow_.mean(bin), 0);
  }
  FigureList flow(figures, "median flow a frame [px]");
  flow.add_quantiles("", flow_, {5, 25, 50, 75, 95, 100}, 1);
}

}  // namespace km
