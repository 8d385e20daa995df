#include "apps/vocabulary/truth_poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include "modules/core/text_rows.hpp"

namespace km {
namespace {

StampedPose parse(const TextRow& row, bool is_csv, const std::string& file) {
  const auto fail = [&](const char* what) {
    return std::runtime_error(file + ", line " + std::to_string(row.line) + ": " + what);
  };
  if (row.fields.size() < 8) throw fail("a pose needs 8 numbers");
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::optional<double> number = parse_double(row.fields[i + 1]);
    if (!number || !std::isfinite(*number)) throw fail("not a number");
    v[i] = *number;
  }
  const Eigen::Quaterniond q = is_csv ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                                      : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
  if (std::abs(q.norm() - 1.0) > 1e-2) throw fail("the quaternion is not of unit length");
  StampedPose pose{0, make_pose(q.normalized().toRotationMatrix(), {v[0], v[1], v[2]})};
  const std::optional<std::int64_t> t_ns = parse_int64(row.fields[0]);
  const std::optional<double> t_s = parse_double(row.fields[0]);
  if (is_csv ? !t_ns : !t_s) throw fail("the time is not a number");
  pose.stamp = is_csv ? *t_ns : nanoseconds(*t_s);
  return pose;
}

}  // namespace

std::vector<StampedPose> read_truth(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file.string() + " cannot be read");
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const bool is_csv = file.extension() == ".csv";
  std::vector<StampedPose> poses;
  for (const TextRow& row : split_rows(text)) poses.push_back(parse(row, is_csv, file.string()));
  std::sort(poses.begin(), poses.end(),
            [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  return poses;
}

std::optional<SE3> pose_at(std::span<const StampedPose> poses, Stamp stamp, double tolerance_s) {
  const auto distance_s = [stamp](const StampedPose& pose) {
    return std::abs(seconds_between(stamp, pose.stamp));
  };
  const auto nearest =
      std::min_element(poses.begin(), poses.end(),
                       [&](const auto& a, const auto& b) { return distance_s(a) < distance_s(b); });
  if (nearest == poses.end() || distance_s(*nearest) > tolerance_s) return std::nullopt;
  return nearest->T;
}

Stamp stamp_of_image(const std::filesystem::path& image) {
  const std::string name = image.filename().string();
  const std::string digits = name.substr(0, name.find_first_not_of("0123456789"));
  const std::optional<std::int64_t> stamp = parse_int64(digits);
  if (!stamp) throw std::runtime_error(image.string() + ": the name does not start with a stamp");
  return *stamp;
}

}  // namespace km
