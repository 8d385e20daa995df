#include "modules/evaluation/trajectory_error.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "modules/evaluation/report.hpp"

namespace km {
namespace {

constexpr std::size_t kLengths = 4;
constexpr double kMinLength_m = 0.01;

// The estimated motion from i to j in the frame of the true one, see segment_errors().
SE3 relative_error(const PosePair& i, const PosePair& j) {
  const SE3 T_i_j = i.T_truth_body.inverse() * j.T_truth_body;
  return T_i_j.inverse() * (i.T_estimate_body.inverse() * j.T_estimate_body);
}

// True path from the first pair to each [m].
std::vector<double> distances(std::span<const PosePair> pairs) {
  std::vector<double> result(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i)
    result[i] =
        result[i - 1] +
        (pairs[i].T_truth_body.translation() - pairs[i - 1].T_truth_body.translation()).norm();
  return result;
}

}  // namespace

std::vector<double> segment_lengths(double path_m) {
  std::vector<double> lengths;
  for (double decade = kMinLength_m; decade <= 0.5 * path_m; decade *= 10.0)
    for (const double step : {1.0, 2.0, 5.0})
      if (step * decade <= 0.5 * path_m) lengths.push_back(step * decade);
  if (lengths.size() > kLengths)
    lengths.erase(lengths.begin(), lengths.end() - static_cast<std::ptrdiff_t>(kLengths));
  return lengths;
}

SegmentErrors segment_errors(std::span<const PosePair> pairs) {
  SegmentErrors errors;
  const std::vector<double> at_m = distances(pairs);
  for (const double length_m : segment_lengths(at_m.empty() ? 0.0 : at_m.back())) {
    std::size_t j = 0;
    bool used = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      while (j < pairs.size() && at_m[j] - at_m[i] < length_m) ++j;
      if (j == pairs.size()) break;
      const double path_m = at_m[j] - at_m[i];
      const SE3 error = relative_error(pairs[i], pairs[j]);
      errors.translation_percent.push_back(100.0 * error.translation().norm() / path_m);
      errors.rotation_deg_per_m.push_back(kDegrees * angle_of(error.linear()) / path_m);
      used = true;
    }
    if (used) errors.lengths_m.push_back(length_m);
  }
  return errors;
}

namespace {

constexpr std::size_t kMinPairs = 3;
constexpr double kMaxCoverageGap_s = 2.0;  // largest interval between poses that is covered
constexpr double kSurroundings_m = 5.0;
constexpr double kDelta_s = 1.0;  // time over which relative errors are taken

void append(std::vector<double>& to, const std::vector<double>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

// Errors of one or several estimates before they are summarised.
struct Errors {
  std::vector<double> position_m, rotation_deg, rpe_translation_m, rpe_rotation_deg;
  SegmentErrors segments;
  std::size_t poses = 0;
  double covered_s = 0.0;
  double window_s = 0.0;

  void append(const Errors& other) {
    for (const auto list : {&Errors::position_m, &Errors::rotation_deg, &Errors::rpe_translation_m,
                            &Errors::rpe_rotation_deg})
      km::append(this->*list, other.*list);
    for (const auto list : {&SegmentErrors::translation_percent, &SegmentErrors::rotation_deg_per_m,
                            &SegmentErrors::lengths_m})
      km::append(segments.*list, other.segments.*list);
    poses += other.poses;
    covered_s += other.covered_s;
    window_s += other.window_s;
  }
};

TrajectoryError summary(const std::string& name, const Errors& errors) {
  // With several robots, lengths are repeated.
  std::vector<double> lengths_m = errors.segments.lengths_m;
  std::sort(lengths_m.begin(), lengths_m.end());
  lengths_m.erase(std::unique(lengths_m.begin(), lengths_m.end()), lengths_m.end());
  return {.name = name,
          .poses = errors.poses,
          .position_m = statistics_of(errors.position_m),
          .rotation_deg = statistics_of(errors.rotation_deg),
          .rpe_translation_m = statistics_of(errors.rpe_translation_m),
          .rpe_rotation_deg = statistics_of(errors.rpe_rotation_deg),
          .segment_lengths_m = lengths_m,
          .drift_percent = statistics_of(errors.segments.translation_percent),
          .drift_deg_per_m = statistics_of(errors.segments.rotation_deg_per_m),
          .completeness = errors.window_s > 0.0 ? errors.covered_s / errors.window_s : 0.0};
}

TimeWindow window_of(const TrajectoryInput& input) {
  return input.window.value_or(TimeWindow{input.truth.front().stamp, input.truth.back().stamp});
}

void add_absolute_errors(std::span<const PosePair> pairs, const SE3& T_truth_estimate,
                         Errors& errors) {
  for (const PosePair& pair : pairs) {
    const SE3 T_truth_body = T_truth_estimate * pair.T_estimate_body;
    errors.position_m.push_back(
        (T_truth_body.translation() - pair.T_truth_body.translation()).norm());
    errors.rotation_deg.push_back(
        kDegrees * angle_of(pair.T_truth_body.linear().transpose() * T_truth_body.linear()));
  }
}

void add_relative_errors(std::span<const PosePair> pairs, Errors& errors) {
  constexpr double kTolerance_s = 0.1 * kDelta_s;
  // Tolerance at the end of the trajectory, as a share of kDelta_s.
  constexpr double kJitter = 0.01;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (seconds_between(pairs[i].stamp, pairs.back().stamp) < (1.0 - kJitter) * kDelta_s) break;
    const auto off_s = [&](std::size_t k) {
      return std::abs(seconds_between(pairs[i].stamp, pairs[k].stamp) - kDelta_s);
    };
    while (j + 1 < pairs.size() && off_s(j + 1) <= off_s(j)) ++j;
    if (j <= i || off_s(j) > kTolerance_s) continue;
    const SE3 error = relative_error(pairs[i], pairs[j]);
    errors.rpe_translation_m.push_back(error.translation().norm());
    errors.rpe_rotation_deg.push_back(kDegrees * angle_of(error.linear()));
  }
}

std::vector<PosePair> associate(const TrajectoryInput& input, std::size_t least) {
  if (input.truth.empty()) throw std::invalid_argument(input.name + ": the truth holds no pose");
  auto pairs = associate(input.truth, input.estimate, window_of(input));
  if (pairs.size() < least)
    throw std::invalid_argument(input.name + ": only " + std::to_string(pairs.size()) + " of its " +
                                std::to_string(input.estimate.size()) +
                                " poses fall on the truth's time, at least " +
                                std::to_string(least) + " are needed");
  return pairs;
}

}  // namespace

SE3 align(std::span<const PosePair> pairs) {
  const auto n = static_cast<Eigen::Index>(pairs.size());
  Eigen::Matrix3Xd estimate(3, n);
  Eigen::Matrix3Xd truth(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    estimate.col(i) = pairs[static_cast<std::size_t>(i)].T_estimate_body.translation();
    truth.col(i) = pairs[static_cast<std::size_t>(i)].T_truth_body.translation();
  }
  return SE3(Eigen::umeyama(estimate, truth, false));
}

std::vector<double> aligned_errors_m(std::span<const PosePair> pairs) {
  Errors errors;
  add_absolute_errors(pairs, align(pairs), errors);
  return errors.position_m;
}

TeamError trajectory_error(std::span<const TrajectoryInput> inputs) {
  if (inputs.empty()) throw std::invalid_argument("trajectory_error: no estimate");
  std::vector<std::vector<PosePair>> pairs;
  std::vector<PosePair> all;
  for (const TrajectoryInput& input : inputs) {
    pairs.push_back(associate(input, kMinPairs));
    all.insert(all.end(), pairs.back().begin(), pairs.back().end());
  }

  TeamError team;
  team.T_truth_estimate = align(all);
  Errors joint;
  for (std::size_t r = 0; r < inputs.size(); ++r) {
    Errors errors;
    add_absolute_errors(pairs[r], team.T_truth_estimate, errors);
    add_relative_errors(pairs[r], errors);
    errors.segments = segment_errors(pairs[r]);
    const TimeWindow window = window_of(inputs[r]);
    errors.poses = inputs[r].estimate.size();
    errors.covered_s = covered_seconds(inputs[r].estimate, window, kMaxCoverageGap_s);
    errors.window_s = seconds_between(window.from, window.to);
    team.robots.push_back(summary(inputs[r].name, errors));
    joint.append(errors);
  }
  team.joint = summary("team", joint);
  return team;
}

namespace {

SE3 with_rotation(const SE3& T, double w, double x, double y, double z) {
  SE3 result = T;
  result.linear() = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
  return result;
}

SE3 with_scale(const SE3& T, double scale) {
  SE3 result = T;
  result.translation() *= scale;
  return result;
}

struct Notation {
  const char* text;
  SE3 (*undone)(const SE3& T, const Eigen::Quaterniond& q);
};
constexpr const char* kOrder = "one has w first in its quaternions, the other w last";
constexpr const char* kUnits = "one has metres, the other millimetres";
constexpr Notation kNotations[] = {
    {kOrder,
     [](const SE3& T, const auto& q) { return with_rotation(T, q.x(), q.y(), q.z(), q.w()); }},
    {kOrder,
     [](const SE3& T, const auto& q) { return with_rotation(T, q.z(), q.w(), q.x(), q.y()); }},
    {"the rotations of one are inverse",
     [](const SE3& T, const auto& q) { return with_rotation(T, q.w(), -q.x(), -q.y(), -q.z()); }},
    {"the poses of one are inverse", [](const SE3& T, const auto&) { return T.inverse(); }},
    {kUnits, [](const SE3& T, const auto&) { return with_scale(T, 1e-3); }},
    {kUnits, [](const SE3& T, const auto&) { return with_scale(T, 1e3); }}};
// Almost still: a trajectory of one point has no alignment.
constexpr Notation kStill = {"", [](const SE3& T, const auto&) { return with_scale(T, 1e-9); }};

// Error of the estimate with a notation undone.
TrajectoryError error_if(const TrajectoryInput& input, const Notation& notation) {
  std::vector<StampedPose> poses(input.estimate.begin(), input.estimate.end());
  for (StampedPose& pose : poses)
    pose.T = notation.undone(pose.T, Eigen::Quaterniond(pose.T.linear()));
  return trajectory_error(std::array{TrajectoryInput{input.name, input.truth, poses, input.window}})
      .joint;
}

}  // namespace

std::string difference_of_notation(const TrajectoryInput& input) {
  constexpr double kBetter = 0.1, kWorse = 1.001;
  constexpr double kLeast_m = 0.1, kLeast_deg = 1.0;  // errors of odometry that works
  constexpr double kOfStill = 0.3;
  const TrajectoryError read = trajectory_error({&input, 1}).joint;
  const double metres = read.rpe_translation_m.rmse, degrees = read.rpe_rotation_deg.rmse;
  if (read.rpe_rotation_deg.count == 0 || (metres < kLeast_m && degrees < kLeast_deg)) return {};
  const double still_m = error_if(input, kStill).rpe_translation_m.rmse;
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const Notation& notation : kNotations) {
    const TrajectoryError undone = error_if(input, notation);
    // Any estimate of a large scale comes nearer to the truth if it hardly moves.
    if (undone.rpe_translation_m.rmse > kOfStill * still_m) continue;
    const double m = undone.rpe_translation_m.rmse / std::max(metres, kLeast_m);
    const double deg = undone.rpe_rotation_deg.rmse / std::max(degrees, kLeast_deg);
    if (std::max(m, deg) > kWorse || std::min(m, deg) > kBetter || m + deg > least) continue;
    least = m + deg;
    best = notation.text;
  }
  return best;
}

SE3 align_surroundings(std::span<const TrajectoryInput> inputs) {
  std::vector<PosePair> around;
  for (const TrajectoryInput& input : inputs) {
    const auto pairs = associate(input, 0);
    if (pairs.empty())
      throw std::invalid_argument(input.name + ": none of its " +
                                  std::to_string(input.estimate.size()) +
                                  " poses falls on the truth's time");
    for (const PosePair& pair : pairs)
      for (int axis = 0; axis < 3; ++axis)
        for (const double side_m : {-kSurroundings_m, kSurroundings_m}) {
          const Eigen::Vector3d point = side_m * Eigen::Vector3d::Unit(axis);
          PosePair& added = around.emplace_back();
          added.T_truth_body.translation() = pair.T_truth_body * point;
          added.T_estimate_body.translation() = pair.T_estimate_body * point;
        }
  }
  if (around.empty()) throw std::invalid_argument("align_surroundings: no trajectory");
  return align(around);
}

std::string to_table(const TeamError& team) {
  constexpr ReportColumn kColumns[] = {{"estimate", "/name"},
                                       {"pairs", "/pairs"},
                                       {"position error [m]: rmse", "/position_m/rmse", 4},
                                       {"mean", "/position_m/mean", 4},
                                       {"median", "/position_m/median", 4},
                                       {"max", "/position_m/max", 4},
                                       {"rotation [deg]", "/rotation_deg/rmse", 3},
                                       {"relative [m]", "/rpe_translation_m/rmse", 4},
                                       {"[deg]", "/rpe_rotation_deg/rmse", 3},
                                       percent_column("covered", "/completeness")};
  const Json json = team;
  Json rows = json["robots"];
  if (rows.size() > 1) rows.push_back(json["joint"]);
  std::string text = report_table(rows, kColumns);
  const auto lacks_relative = [](const TrajectoryError& error) {
    return error.rpe_translation_m.count == 0;
  };
  if (std::ranges::any_of(team.robots, lacks_relative))
    text += "-: no two compared poses lie a second apart, so there is no relative error\n";
  return text;
}

void to_json(Json& json, const TrajectoryError& error) {
  json = {{"name", error.name},
          {"poses", error.poses},
          {"pairs", error.position_m.count},
          {"completeness", error.completeness},
          {"position_m", error.position_m},
          {"rotation_deg", error.rotation_deg},
          {"rpe_translation_m", error.rpe_translation_m},
          {"rpe_rotation_deg", error.rpe_rotation_deg},
          {"segment_lengths_m", error.segment_lengths_m},
          {"drift_percent", error.drift_percent},
          {"drift_deg_per_m", error.drift_deg_per_m}};
}

void to_json(Json& json, const TeamError& team) {
  json = {{"alignment", pose_json(team.T_truth_estimate)},
          {"robots", team.robots},
          {"joint", team.joint}};
}

}  // namespace km
