#include "modules/sensors/usual_numbers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core/types.hpp>
#include <string_view>
#include <utility>

#include "modules/core/config.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/core/quantile.hpp"
#include "modules/recordings/bag_summary.hpp"

namespace km {
namespace {

// A usual mistake multiplies the number by this factor.
struct Confusion {
  double factor;
  std::string_view words;
  std::string_view id = {};  // id of the finding; empty: that of the number
};

struct Row {
  std::string_view id, name, unit;
  Bounds<double> usual;
  std::array<Confusion, 4> confusions;  // a factor of 0 is none
  std::string_view means, to_do;
  Bounds<double> possible = usual;  // a confusion is only a question within it
};

constexpr double kG_mps2 = 9.80665;
constexpr std::string_view kStamps =
    "check the unit of the stamps: the reader takes a whole number as nanoseconds";

// In the order of UsualNumber.
constexpr std::array<Row, 8> kRows = {{
    {"stereo.baseline",
     "a baseline",
     "m",
     {0.01, 1.0},
     {{{100.0, "in centimetres"}, {1000.0, "in millimetres"}, {39.37, "in inches"}}},
     "if its unit is wrong, all lengths are wrong by the same factor",
     "state translations in metres; in CameraInfo, P[3] of the right camera is -fx times the "
     "baseline in metres"},
    {"extrinsics.lever",
     "the left camera at a distance from the body's origin",
     "m",
     {0.0, 3.0},
     {{{1000.0, "in millimetres"}, {100.0, "in centimetres"}}},
     "odometry expects motion of the camera that does not occur, and drifts or restarts",
     "state the translation of T_body_cam (T_cam_imu) in metres"},
    {"frames.stamps",
     "images at a rate",
     "Hz",
     {1.0, 1000.0},
     {{{1e3, "of stamps in microseconds"},
       {1e6, "of stamps in milliseconds"},
       {1e9, "of stamps in seconds"}}},
     "odometry does not start on such stamps",
     kStamps},
    {"imu.stamps",
     "inertial samples at a rate",
     "Hz",
     {10.0, 2e4},
     {{{1e3, "of stamps in microseconds"},
       {1e6, "of stamps in milliseconds"},
       {1e9, "of stamps in seconds"}}},
     "odometry does not start on such stamps",
     kStamps},
    {"imu.gravity",
     "an accelerometer with a median norm",
     "m/s^2",
     {8.3, 11.3},
     {{{1.0 / kG_mps2, "in g", "imu.accel_in_g"},
       {1e3 / kG_mps2, "in thousandths of g", "imu.accel_in_g"},
       {kG_mps2, "multiplied by 9.80665 twice"},
       {100.0, "in cm/s^2"}}},
     "odometry estimates a wrong direction of gravity, or does not start",
     "write specific force in m/s^2, including gravity"},
    {"depth.size",
     "depth with a median",
     "m",
     {0.35, 50.0},
     {{{1e3, "in millimetres"},
       {1e-3, "multiplied by 0.001 twice"},
       {10.0, "in units of 0.1 mm"},
       {0.1, "in centimetres"}}},
     "if its unit is wrong, all lengths are wrong by the same factor",
     "state depth: {scale_m: ...} in the rig file (depth_scale: of a folder), the depth of one "
     "unit of a 16-bit image: 0.01 for centimetres",
     {0.1, 50.0}},
    {"depth.share",
     "depth for a share",
     "of the pixels",
     {0.005, 1.0},
     {},
     "odometry and map get no depth",
     "check depth: {scale_m, min_range_m, max_range_m} in the rig file against the unit of the "
     "images"},
    {"depth.ray",
     "depth on planes that follows the length of the ray with a power",
     "",
     {-0.5, 0.5},
     {},
     "images of z have the power 0; with 1 they hold the distance along the ray, and walls bend",
     "let the driver or simulator write z, the distance along the optical axis"},
}};

// Value with four digits, "20000" and not "2e+04".
std::string number_text(double value) {
  return value >= 1e3 && value < 1e7 ? fixed(value, 0) : rounded(value, 4);
}

double median_norm(const std::vector<ImuSample>& samples, Eigen::Vector3d ImuSample::*value) {
  std::vector<double> norms;
  norms.reserve(samples.size());
  for (const ImuSample& sample : samples) norms.push_back((sample.*value).norm());
  return quantile(std::move(norms), 0.5);
}

// The power p with which depth z |ray|^p follows the length of its ray on a plane: 0 for z, 1 for
// distances along the ray. On a plane 1/z = a x + b y + c on bearings (x, y), so that depth d has
// 1/d = a x + b y + c - p log|ray| / d to first order. nullopt if the patch is not planar, or too
// small for a power within kMaxSigma.
std::optional<double> depth_power(const DepthImage& depth, const Camera& camera,
                                  const cv::Rect& patch) {
  constexpr double kLeastShare = 0.7, kMostNoise = 0.01, kMaxSigma = 0.05, kSure = 3.0,
                   kLeast = 1e-9;
  const int step = std::max(depth.width / 80, 1);
  std::vector<Eigen::Matrix<double, 5, 1>> rows;  // the four factors, and 1/d
  std::size_t pixels = 0;
  for (int v = patch.y; v < patch.br().y; v += step)
    for (int u = patch.x; u < patch.br().x; u += step) {
      ++pixels;
      const auto at = static_cast<std::size_t>(v) * static_cast<std::size_t>(depth.width) +
                      static_cast<std::size_t>(u);
      const auto bearing = camera.unproject({u, v});
      if (depth.millimetres[at] == 0 || !bearing) continue;
      const double inverse = 1e3 / depth.millimetres[at];
      const double length = bearing->homogeneous().norm();
      rows.push_back({bearing->x(), bearing->y(), 1.0, -std::log(length) * inverse, inverse});
    }
  for (int round = 0; static_cast<double>(rows.size()) > kLeastShare * static_cast<double>(pixels);
       ++round) {
    Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    for (const auto& row : rows) {
      A += row.head<4>() * row.head<4>().transpose();
      b += row.head<4>() * row[4];
    }
    const Eigen::Matrix4d inverse = A.inverse();
    const Eigen::Vector4d factors = inverse * b;
    std::vector<double> errors;
    for (const auto& row : rows) errors.push_back(std::abs(row[4] - factors.dot(row.head<4>())));
    const double sigma = 1.4826 * quantile(std::move(errors), 0.5);
    if (round == 3) {
      const bool is_good =
          sigma < kMostNoise * b[2] / A(2, 2) && sigma * std::sqrt(inverse(3, 3)) < kMaxSigma;
      return is_good ? std::optional(factors[3]) : std::nullopt;
    }
    std::erase_if(rows, [&](const auto& row) {
      return std::abs(row[4] - factors.dot(row.template head<4>())) > kSure * sigma + kLeast;
    });
  }
  return std::nullopt;
}

}  // namespace

std::optional<Doubt> doubt(UsualNumber number, double value) {
  const Row& row = kRows.at(static_cast<std::size_t>(number));
  if (std::isnan(value) || row.usual.contains(value)) return std::nullopt;
  const auto text = [&row](double shown) {
    return number_text(shown) + (row.unit.empty() ? "" : " ") + std::string(row.unit);
  };
  Doubt doubt{.id = std::string(row.id),
              .what = std::string(row.name) + " of " + text(value) + ", usually " +
                      number_text(row.usual.min) + " to " + text(row.usual.max),
              .means = std::string(row.means),
              .to_do = std::string(row.to_do)};
  for (const Confusion& confusion : row.confusions) {
    if (confusion.factor <= 0.0 || !row.usual.contains(value / confusion.factor)) continue;
    doubt.what += (doubt.is_explained ? ", or " : ": ") + text(value / confusion.factor) + " if " +
                  std::string(confusion.words);
    if (!confusion.id.empty() && !doubt.is_explained) doubt.id = confusion.id;
    doubt.is_explained = true;
  }
  if (row.possible.contains(value)) doubt.is_explained = false;
  if (number == UsualNumber::kGravity_mps2 && !doubt.is_explained && value < row.usual.min / 2.0) {
    doubt.id = "imu.no_gravity";
    doubt.what += ": the driver subtracts gravity, or uses another unit";
    doubt.to_do = "set the driver to raw acceleration";
    doubt.is_explained = true;
  }
  return doubt;
}

std::optional<Doubt> rate_doubt(UsualNumber number, double rate_hz, double median_s) {
  constexpr double kThousand = 1e3, kTolerance = 1.7;
  const double ratio = kThousand * rate_hz * median_s;
  const bool is_fraction = ratio > 1.0 / kTolerance && ratio < kTolerance;
  return doubt(number, is_fraction ? 1.0 / median_s : rate_hz);
}

std::vector<Doubt> rig_doubts(const StereoRig& rig) {
  std::vector<Doubt> doubts;
  const bool has_pair = rig.depth_source == DepthSource::kRightImage;
  const double baseline_m = rig.baseline_m();  // 0 without a calibration
  if (const auto found = doubt(UsualNumber::kBaseline_m, baseline_m);
      found && has_pair && baseline_m > 0.0)
    doubts.push_back(*found);
  const double lever_m = rig.cameras[0].T_body_cam.translation().norm();
  if (const auto found = doubt(UsualNumber::kLever_m, lever_m)) doubts.push_back(*found);
  return doubts;
}

double median_acceleration(const std::vector<ImuSample>& samples) {
  return median_norm(samples, &ImuSample::accel);
}

std::optional<Doubt> gravity_doubt(const std::vector<ImuSample>& samples) {
  auto found = doubt(UsualNumber::kGravity_mps2, median_acceleration(samples));
  const double gyro = median_norm(samples, &ImuSample::gyro);
  if (!found || doubt(UsualNumber::kGravity_mps2, gyro)) return found;
  found->id = "imu.exchanged";
  found->what +=
      ", and a gyroscope with one of " + number_text(gyro) + " rad/s: they are exchanged";
  found->to_do = "exchange the columns or the topics of gyroscope and accelerometer";
  found->is_explained = true;
  return found;
}

void FirstPackets::add_depth(const DepthImage& depth, const Camera& camera) {
  constexpr std::size_t kStep = 101;  // not a divisor of usual widths
  const std::vector<std::uint16_t>& depth_mm = depth.millimetres;
  for (std::size_t k = 0; k < depth_mm.size(); k += kStep) depths_m_.push_back(1e-3 * depth_mm[k]);
  // Patches of a third of the image, which overlap by half.
  for (int i = 0; i < 25; ++i)
    if (const auto power = depth_power(
            depth, camera,
            {i % 5 * depth.width / 6, i / 5 * depth.height / 6, depth.width / 3, depth.height / 3}))
      powers_.push_back(*power);
}

std::vector<Doubt> FirstPackets::add(const SensorPacket& packet, const Camera& camera) {
  if (frames_.size() >= kFrames) return {};
  frames_.push_back(packet.frame->stamp);
  samples_.insert(samples_.end(), packet.imu.begin(), packet.imu.end());
  if (packet.frame->depth != nullptr) add_depth(*packet.frame->depth, camera);
  if (frames_.size() < kFrames) return {};
  std::vector<Doubt> doubts;
  const auto judge = [&doubts](UsualNumber number, double value) {
    if (const auto found = doubt(number, value)) doubts.push_back(*found);
  };
  const auto judge_rate = [&doubts](UsualNumber number, std::vector<Stamp> stamps) {
    const StampStatistics all = stamp_statistics(std::move(stamps));
    if (const auto found = rate_doubt(number, all.rate_hz, all.median_s)) doubts.push_back(*found);
  };
  judge_rate(UsualNumber::kImageRate_hz, frames_);
  std::vector<Stamp> of_samples;
  for (const ImuSample& sample : samples_) of_samples.push_back(sample.stamp);
  judge_rate(UsualNumber::kImuRate_hz, std::move(of_samples));
  if (const auto found = gravity_doubt(samples_)) doubts.push_back(*found);
  const auto unmeasured =
      std::partition(depths_m_.begin(), depths_m_.end(), [](double m) { return m > 0.0; });
  const auto count = static_cast<std::size_t>(unmeasured - depths_m_.begin());
  judge(UsualNumber::kDepthShare,
        static_cast<double>(count) / static_cast<double>(depths_m_.size()));  // NaN without depth
  depths_m_.resize(count);
  judge(UsualNumber::kDepth_m, quantile(depths_m_, 0.5));
  constexpr std::size_t kLeastPatches = 20;
  if (powers_.size() >= kLeastPatches) judge(UsualNumber::kDepthPower, quantile(powers_, 0.5));
  depths_m_ = powers_ = {};
  samples_ = {};
  return doubts;
}

}  // namespace km
